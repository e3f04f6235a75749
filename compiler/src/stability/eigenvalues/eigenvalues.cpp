// SPDX-License-Identifier: Apache-2.0
#include "stability/eigenvalues/eigenvalues.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "stability/eigenvalues/hessenberg.h"

namespace dpde::stability {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

constexpr int most_on_stack = 4;

/// Matrices up to most_on_stack rows, stored on the stack.
using Small = Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, 0, most_on_stack, most_on_stack>;

/// E. E. Osborne, "On pre-conditioning of matrices", J. ACM 7 (1960): by powers of two, in the 1-norm.
/// The result times an eigenvector of the new `a` is an eigenvector of the old one.
template <class Matrix>
Eigen::VectorXd balance(Matrix& a) {
  Eigen::VectorXd scales = Eigen::VectorXd::Ones(a.rows());
  for (int sweep = 0; sweep < 20; ++sweep) {
    bool has_changed = false;
    for (Index i = 0; i < a.rows(); ++i) {
      const double own = std::abs(a(i, i));
      const double row = a.row(i).cwiseAbs().sum() - own, column = a.col(i).cwiseAbs().sum() - own;
      if (!(row > 0) || !(column > 0)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (factor == 1) continue;
      a.row(i) /= factor;
      a.col(i) *= factor;
      scales[i] *= factor;
      has_changed = true;
    }
    if (!has_changed) break;
  }
  return scales;
}

/// Reduces `a` to Hessenberg form by Householder reflections (G. H. Golub and C. F. Van Loan, Matrix Computations,
/// 7.4.2). Plain loops: Eigen's reduction takes half a minute to compile. If `basis` is not null, the former `a` is
/// basis * a * basis^H.
template <class Matrix>
void reduce_to_hessenberg(Matrix& a, Matrix* basis = nullptr) {
  using Scalar = typename Matrix::Scalar;
  const Index size = a.rows();
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1, 0, Matrix::MaxRowsAtCompileTime, 1> v(size), sums(size);
  for (Index k = 0; k + 2 < size; ++k) {
    double below = 0;
    for (Index i = k + 1; i < size; ++i) {
      v[i] = a(i, k);
      if (i > k + 1) below += Eigen::numext::abs2(v[i]);
    }
    if (below == 0) continue;
    const double first = std::abs(v[k + 1]), length = std::sqrt(below + first * first);
    const Scalar direction = first > 0 ? v[k + 1] / first : Scalar(1);
    v[k + 1] += direction * length;
    const double factor = 1 / (length * (length + first));  // 2/|v|^2
    for (Index j = k; j < size; ++j) {
      Scalar sum = 0;
      for (Index i = k + 1; i < size; ++i) sum += product(Eigen::numext::conj(v[i]), a(i, j));
      sum *= factor;
      for (Index i = k + 1; i < size; ++i) a(i, j) -= product(v[i], sum);
    }
    for (Matrix* each : {&a, basis}) {
      if (each == nullptr) continue;
      sums.setZero();
      for (Index j = k + 1; j < size; ++j) {
        for (Index i = 0; i < size; ++i) sums[i] += product((*each)(i, j), v[j]);
      }
      for (Index j = k + 1; j < size; ++j) {
        const Scalar of_column = factor * Eigen::numext::conj(v[j]);
        for (Index i = 0; i < size; ++i) (*each)(i, j) -= product(sums[i], of_column);
      }
    }
    for (Index i = k + 2; i < size; ++i) a(i, k) = 0;
  }
}

/// Eigenvalues of a Hessenberg matrix by Eigen's Schur form.
template <class Matrix>
Eigen::VectorXcd diagonal_of_schur(Matrix a) {
  Eigen::ComplexSchur<Matrix> schur(a.rows());
  schur.computeFromHessenberg(a, a, false);
  return schur.matrixT().diagonal();
}

Eigen::VectorXcd diagonal_of_schur(const Eigen::MatrixXd& a) {
  const Index size = a.rows();
  Eigen::RealSchur<Eigen::MatrixXd> schur(size);
  schur.computeFromHessenberg(a, a, false);
  const Eigen::MatrixXd& t = schur.matrixT();
  Eigen::VectorXcd values(size);
  for (Index i = 0; i < size; ++i) {
    values[i] = t(i, i);
    if (i + 1 == size || t(i + 1, i) == 0) continue;
    const double mean = 0.5 * (t(i, i) + t(i + 1, i + 1)), half = 0.5 * (t(i, i) - t(i + 1, i + 1));
    const Complex root = std::sqrt(Complex(half * half + t(i + 1, i) * t(i, i + 1)));  // of a pair
    values[i] = mean + root;
    values[++i] = mean - root;
  }
  return values;
}

/// By Eigen's Schur form, with other shifts, if the QR sweeps do not converge. That may happen if many entries are
/// rounding errors.
template <class Matrix>
Eigen::VectorXcd of_hessenberg(Matrix a) {
  Eigen::VectorXcd values = hessenberg_eigenvalues(a);
  return values.size() == a.rows() ? values : diagonal_of_schur(std::move(a));
}

template <class Matrix>
Eigen::VectorXcd as_it_is(Matrix a) {
  reduce_to_hessenberg(a);
  return of_hessenberg(std::move(a));
}

/// Inverse iteration by elimination with partial pivoting; a zero pivot is replaced by `least`.
class Elimination {
 public:
  Elimination(Eigen::MatrixXcd a, double least) : a_(std::move(a)), pivots_(static_cast<std::size_t>(a_.rows())) {
    const Index size = a_.rows();
    for (Index k = 0; k < size; ++k) {
      Index pivot = k;
      for (Index i = k + 1; i < size; ++i) {
        if (std::abs(a_(i, k)) > std::abs(a_(pivot, k))) pivot = i;
      }
      pivots_[static_cast<std::size_t>(k)] = pivot;
      for (Index j = 0; j < size; ++j) std::swap(a_(k, j), a_(pivot, j));
      if (!(std::abs(a_(k, k)) > least)) a_(k, k) = least;
      for (Index i = k + 1; i < size; ++i) a_(i, k) /= a_(k, k);
      for (Index j = k + 1; j < size; ++j) {
        for (Index i = k + 1; i < size; ++i) a_(i, j) -= a_(i, k) * a_(k, j);
      }
    }
  }

  /// An eigenvector of the matrix, or of its adjoint, with largest component 1.
  Eigen::VectorXcd vector(bool of_adjoint) const {
    Eigen::VectorXcd x(a_.rows());  // a start that is not orthogonal to it by symmetry
    for (Index i = 0; i < x.size(); ++i) x[i] = 1 + 0.5 * std::sin(static_cast<double>(i * i + 1));
    for (int turn = 0; turn < 3; ++turn) {
      of_adjoint ? solve_adjoint(x) : solve(x);
      x /= x.cwiseAbs().maxCoeff();
    }
    return x;
  }

 private:
  void solve(Eigen::VectorXcd& x) const {
    const Index size = a_.rows();
    for (Index k = 0; k < size; ++k) std::swap(x[k], x[pivots_[static_cast<std::size_t>(k)]]);
    for (Index k = 0; k < size; ++k) {
      for (Index i = k + 1; i < size; ++i) x[i] -= a_(i, k) * x[k];
    }
    for (Index k = size; k-- > 0;) {
      x[k] /= a_(k, k);
      for (Index i = 0; i < k; ++i) x[i] -= a_(i, k) * x[k];
    }
  }
  void solve_adjoint(Eigen::VectorXcd& x) const {
    const Index size = a_.rows();
    for (Index k = 0; k < size; ++k) {
      for (Index i = 0; i < k; ++i) x[k] -= std::conj(a_(i, k)) * x[i];
      x[k] /= std::conj(a_(k, k));
    }
    for (Index k = size; k-- > 0;) {
      for (Index i = k + 1; i < size; ++i) x[k] -= std::conj(a_(i, k)) * x[i];
    }
    for (Index k = size; k-- > 0;) std::swap(x[k], x[pivots_[static_cast<std::size_t>(k)]]);
  }

  Eigen::MatrixXcd a_;  // both factors
  std::vector<Index> pivots_;
};

Elimination elimination_near(Eigen::MatrixXcd a, Complex value) {
  const double size = std::max(a.cwiseAbs().maxCoeff(), std::abs(value));
  a.diagonal().array() -= value;
  return {std::move(a), 1e-15 * size + 1e-300};
}

}  // namespace

Eigen::VectorXcd eigenvalues(Eigen::MatrixXcd a) {
  if (a.rows() == 1) return a.col(0);
  if (a.rows() == 2) {
    const Complex mean = 0.5 * (a(0, 0) + a(1, 1)), half = 0.5 * (a(0, 0) - a(1, 1));
    const Complex root = std::sqrt(half * half + a(0, 1) * a(1, 0));
    return Eigen::Vector2cd(mean + root, mean - root);
  }
  if (a.rows() > most_on_stack && a.imag().isZero(0)) return eigenvalues(Eigen::MatrixXd(a.real()));
  balance(a);
  if (a.rows() > most_on_stack) return as_it_is(std::move(a));
  Small small = a;
  reduce_to_hessenberg(small);
  return diagonal_of_schur(std::move(small));
}

Eigen::VectorXcd eigenvalues(Eigen::MatrixXd a) {
  balance(a);
  return as_it_is(std::move(a));
}

Eigen::VectorXcd eigenvalues_of_space(Eigen::MatrixXd hessenberg) { return of_hessenberg(std::move(hessenberg)); }

Eigen::VectorXcd polynomial_of(const std::vector<double>& polynomial, const Eigen::VectorXcd& values) {
  Eigen::ArrayXcd sum = Eigen::ArrayXcd::Zero(values.size());
  for (std::size_t k = polynomial.size(); k-- > 0;) sum = sum * values.array() + polynomial[k];
  return sum;
}

Eigen::VectorXd scales_of(Eigen::MatrixXd a) { return balance(a); }

namespace {

Eigen::MatrixXd beside_multiple(Eigen::MatrixXd matrix) {
  matrix.diagonal().array() -= matrix.trace() / static_cast<double>(matrix.rows());
  return matrix;
}

/// If all matrices but one are multiples of the identity to rounding, as the neighbours' weights of equal diffusion:
/// any basis suits these, so only the eigenvalues of the one are needed.
std::optional<Eigen::MatrixXcd> diagonals_beside_multiples(const std::vector<Eigen::MatrixXd>& matrices,
                                                           double rounding) {
  const Index size = matrices.front().rows();
  Eigen::MatrixXcd diagonals(size, std::ssize(matrices));
  std::optional<std::size_t> other;
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    const bool is_multiple = beside_multiple(matrices[k]).norm() <= rounding;
    if (!is_multiple && other) return std::nullopt;
    if (!is_multiple) other = k;
    diagonals.col(static_cast<Index>(k)).setConstant(matrices[k].trace() / static_cast<double>(size));
  }
  if (other) diagonals.col(static_cast<Index>(*other)) = eigenvalues(matrices[*other]);
  return diagonals;
}

/// A generic sum of the matrices. Each is scaled to equal size, except multiples of the identity. The weights are
/// distinct, between 0.5 and 1.5, so that opposite matrices do not cancel. Cancellation by chance only costs time, as
/// it is checked afterwards whether all matrices are triangular.
Eigen::MatrixXcd generic_sum(const std::vector<Eigen::MatrixXd>& matrices, double rounding) {
  const Index size = matrices.front().rows();
  Eigen::MatrixXcd sum = Eigen::MatrixXcd::Zero(size, size);
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    const Eigen::MatrixXd part = beside_multiple(matrices[k]);
    const double norm = part.norm();
    if (!(norm > rounding)) continue;
    const double weight = 1 + 0.5 * std::sin(static_cast<double>(k * k + 1));
    sum += (weight / norm * part).cast<Complex>();
  }
  return sum;
}

}  // namespace

std::optional<Eigen::MatrixXcd> common_diagonals(std::vector<Eigen::MatrixXd> matrices) {
  // Allowed rounding units per row for entries below a diagonal, which are dropped. This is the error of the QR method
  // itself: its reflections and rotations (a reduction of n steps and two or three for each eigenvalue, from both
  // sides) cost a few units per row (G. H. Golub and C. F. Van Loan, Matrix Computations, 7.4 and 7.5), the products
  // here two.
  constexpr double roundings = 16;
  const Index size = matrices.front().rows();
  Eigen::MatrixXd sizes = Eigen::MatrixXd::Zero(size, size);
  for (const Eigen::MatrixXd& matrix : matrices) sizes += matrix.cwiseAbs();
  const Eigen::VectorXd scales = balance(sizes);
  for (Eigen::MatrixXd& matrix : matrices)
    matrix = (scales.cwiseInverse().asDiagonal() * matrix * scales.asDiagonal()).eval();
  const double rounding = roundings * static_cast<double>(size) * std::numeric_limits<double>::epsilon() * sizes.norm();
  if (std::optional<Eigen::MatrixXcd> diagonals = diagonals_beside_multiples(matrices, rounding)) return diagonals;
  Eigen::MatrixXcd sum = generic_sum(matrices, rounding), basis = Eigen::MatrixXcd::Identity(size, size);
  reduce_to_hessenberg(sum, &basis);
  Eigen::ComplexSchur<Eigen::MatrixXcd> schur(size);
  schur.computeFromHessenberg(sum, basis, true);
  Eigen::MatrixXcd diagonals(size, std::ssize(matrices));
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    const Eigen::MatrixXcd image = matrices[k].cast<Complex>() * schur.matrixU();
    const Eigen::MatrixXcd turned = schur.matrixU().adjoint() * image;
    const Eigen::MatrixXcd below = turned.triangularView<Eigen::StrictlyLower>();
    if (!(below.norm() <= rounding)) return std::nullopt;
    diagonals.col(static_cast<Index>(k)) = turned.diagonal();
  }
  return diagonals;
}

Index largest_component(Eigen::MatrixXcd a) {
  const Eigen::VectorXd scales = balance(a);
  const Eigen::VectorXcd values = eigenvalues(a);
  Index of_all = 0, component = 0;
  values.cwiseAbs().maxCoeff(&of_all);
  const Eigen::VectorXcd x = elimination_near(std::move(a), values[of_all]).vector(false);
  (scales.array() * x.array().abs()).maxCoeff(&component);
  return component;
}

double sensitivity(Eigen::MatrixXd a, Complex value) {
  balance(a);
  const Elimination elimination = elimination_near(a.cast<Complex>(), value);
  const Eigen::VectorXcd right = elimination.vector(false), left = elimination.vector(true);
  return a.norm() * right.norm() * left.norm() / std::abs(left.dot(right));
}

namespace {

/// |(z - a)^-1| of a Hessenberg matrix. With z - a = QR it is |R^-1|, by inverse iteration; rotations make R.
double norm_of_resolvent(const Eigen::MatrixXd& hessenberg, Complex z) {
  constexpr int turns = 4;
  const Index size = hessenberg.rows();
  Eigen::MatrixXcd r = -hessenberg.cast<Complex>();
  r.diagonal().array() += z;
  for (Index k = 0; k + 1 < size; ++k) {
    const double length = std::hypot(std::abs(r(k, k)), std::abs(r(k + 1, k)));
    if (length == 0) continue;
    const Complex c = r(k, k) / length, s = r(k + 1, k) / length;
    for (Index j = k; j < size; ++j) {
      const Complex upper = r(k, j), lower = r(k + 1, j);
      r(k, j) = product(std::conj(c), upper) + product(std::conj(s), lower);
      r(k + 1, j) = product(c, lower) - product(s, upper);
    }
  }
  Eigen::VectorXcd x(size);
  for (Index i = 0; i < size; ++i) x[i] = 1 + 0.5 * std::sin(static_cast<double>(i * i + 1));
  double squared = 0;
  for (int turn = 0; turn < turns; ++turn) {
    x /= x.norm();
    for (Index k = 0; k < size; ++k)
      x[k] = (x[k] - r.col(k).head(k).dot(x.head(k))) / std::conj(r(k, k));  // of the adjoint
    for (Index k = size; k-- > 0;) {
      x[k] /= r(k, k);
      x.head(k) -= x[k] * r.col(k).head(k);
    }
    squared = x.norm();
  }
  return std::sqrt(squared);
}

}  // namespace

SureSpectrum::SureSpectrum(Eigen::MatrixXd a, Of kind, double rounding) : kind_(kind) {
  balance(a);
  error_ = rounding * a.norm();
  reduce_to_hessenberg(a);
  values_ = of_hessenberg(a);
  hessenberg_ = std::move(a);
  std::ranges::sort(values_, std::greater{}, [&](Complex value) { return size_of(value); });
}

/// The resolvent is largest next to eigenvalues. Those near the boundary are the first to show that it is none.
bool SureSpectrum::is_boundary(double at) const {
  std::vector<Complex> next_to;
  for (const Complex value : values_) {  // the matrix is real: both halves are alike
    if (value.imag() >= 0) next_to.push_back(value);
  }
  std::ranges::sort(next_to, {}, [&](Complex value) { return std::abs(size_of(value) - at); });
  return std::ranges::all_of(next_to, [&](Complex value) {
    const Complex z = kind_ == Of::rates ? Complex(at, value.imag()) : std::polar(at, std::arg(value));
    return error_ * norm_of_resolvent(hessenberg_, z) < 1;
  });
}

bool SureSpectrum::are_beyond(double boundary, Index count) const {
  for (Index last = count - 1; last < values_.size() && size_of(values_[last]) > boundary; ++last) {
    const double beyond = size_of(values_[last]),
                 within = last + 1 < values_.size() ? std::max(boundary, size_of(values_[last + 1])) : boundary;
    const double middle = 0.5 * (beyond + within);
    if (beyond - middle > error_ && is_boundary(middle)) return true;
  }
  return false;
}

double SureSpectrum::boundary_within(double most) const {
  double beyond = most;
  for (const Complex value : values_) {
    const double within = size_of(value);
    if (within >= most) continue;
    const double middle = 0.5 * (beyond + within);
    if (middle - within > error_ && is_boundary(middle)) return middle;
    beyond = within;
  }
  return kind_ == Of::rates ? -std::numeric_limits<double>::infinity() : 0;
}

/// For nearly double eigenvalues the phase of `along` is lost in rounding, so both signs of the perturbation are tried.
double error_of_space(Eigen::MatrixXd a, Complex value, double rest, double rounding) {
  const Elimination elimination = elimination_near(a.cast<Complex>(), value);
  const Eigen::VectorXcd right = elimination.vector(false).normalized(), left = elimination.vector(true).normalized();
  const Complex along = left.dot(right);
  double moved = 0;
  for (const double size : {rounding * a.norm(), -rounding * a.norm()}) {
    const Complex outwards = std::polar(1.0, std::arg(value) + std::arg(along));
    Eigen::MatrixXcd rounded = a.cast<Complex>();
    for (Index k = 0; k < a.cols(); ++k) rounded.col(k) += size * outwards * std::conj(right[k]) * left;
    moved = std::max(moved, as_it_is(std::move(rounded)).cwiseAbs().maxCoeff() - std::abs(value));
  }
  return std::max(rest * std::abs(right[right.size() - 1]) / std::abs(along), moved);
}

}  // namespace dpde::stability
