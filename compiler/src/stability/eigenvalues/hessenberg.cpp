// SPDX-License-Identifier: Apache-2.0
#include "stability/eigenvalues/hessenberg.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <tuple>
#include <utility>

namespace dpde::stability {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

constexpr double unit = std::numeric_limits<double>::epsilon();
constexpr int most_sweeps = 60;   // for each eigenvalue; two or three are usual
constexpr int stuck_sweeps = 10;  // after these an exceptional shift breaks a cycle

double size_of(double a) { return std::abs(a); }
double size_of(const Complex& a) { return std::abs(a.real()) + std::abs(a.imag()); }

/// The first row of the active block that ends at `last`: the subdiagonal entry before it is below the rounding of its
/// neighbours, or below `nothing`.
template <class Matrix>
Index first_of_block(Matrix& h, Index last, double nothing) {
  for (Index i = last; i > 0; --i) {
    const double beside = size_of(h(i - 1, i - 1)) + size_of(h(i, i));
    if (!(size_of(h(i, i - 1)) <= std::max(unit * beside, nothing))) continue;
    h(i, i - 1) = 0;
    return i;
  }
  return 0;
}

/// The last 2 x 2 block, whose eigenvalues are the two shifts: its diagonal, and the product of its other entries.
struct Shifts {
  double upper, lower, across;
};

/// The row at which a sweep begins, and the vector of its first reflection.
struct Start {
  Index row;
  double x, y, z;
};

/// Uses differences to the diagonal to avoid cancellation. The sweep begins at two consecutive small subdiagonal
/// entries if the entries that it then neglects are below rounding.
Start start_of(const Eigen::MatrixXd& h, Index first, Index last, const Shifts& shifts) {
  for (Index k = last - 2;; --k) {
    const double at = h(k, k), upper = shifts.upper - at, lower = shifts.lower - at;
    const Start start{k, (upper * lower - shifts.across) / h(k + 1, k) + h(k, k + 1),
                      h(k + 1, k + 1) - at - upper - lower, h(k + 2, k + 1)};
    if (k == first) return start;
    const double left = std::abs(h(k, k - 1)) * (std::abs(start.y) + std::abs(start.z));
    const double beside = std::abs(h(k - 1, k - 1)) + std::abs(at) + std::abs(h(k + 1, k + 1));
    if (left <= unit * std::abs(start.x) * beside) return start;
  }
}

/// I - v w^T on `count` rows from k on, and on these columns, of the block from `first` to `last`.
void reflect(Eigen::MatrixXd& h, Index k, int count, const double* v, const double* w, Index first, Index last) {
  const Index size = h.rows(), to = std::min(k + 3, last);
  double* columns = h.data();
  for (Index j = k; j <= last; ++j) {
    double* entries = columns + j * size + k;
    const double sum = w[0] * entries[0] + w[1] * entries[1] + (count > 2 ? w[2] * entries[2] : 0);
    for (int i = 0; i < count; ++i) entries[i] -= sum * v[i];
  }
  double *a = columns + k * size, *b = a + size, *c = b + (count > 2 ? size : 0);
  const double last_w = count > 2 ? w[2] : 0, last_v = count > 2 ? v[2] : 0;
  for (Index i = first; i <= to; ++i) {
    const double sum = v[0] * a[i] + v[1] * b[i] + last_v * c[i];
    a[i] -= sum * w[0];
    b[i] -= sum * w[1];
    if (count > 2) c[i] -= sum * last_w;
  }
}

/// A sweep with both shifts.
void sweep(Eigen::MatrixXd& h, Index first, Index last, const Shifts& shifts) {
  auto [start, x, y, z] = start_of(h, first, last, shifts);
  for (Index k = start; k < last; ++k) {
    const int count = k + 1 < last ? 3 : 2;
    if (k > start) x = h(k, k - 1), y = h(k + 1, k - 1), z = count > 2 ? h(k + 2, k - 1) : 0;
    const double scale = std::abs(x) + std::abs(y) + std::abs(z);
    if (scale == 0) continue;
    const double unit_x = x / scale, unit_y = y / scale, unit_z = z / scale;
    const double length = std::copysign(std::sqrt(unit_x * unit_x + unit_y * unit_y + unit_z * unit_z), unit_x);
    const double pivot = unit_x + length;
    const double v[3] = {1, unit_y / pivot, unit_z / pivot};
    const double w[3] = {pivot / length, unit_y / length, unit_z / length};
    if (k > start) {
      h(k, k - 1) = -length * scale;
      for (Index i = k + 1; i < k + count; ++i) h(i, k - 1) = 0;
    } else if (k > first) {
      h(k, k - 1) *= 1 - w[0];
    }
    reflect(h, k, count, v, w, first, last);
  }
}

/// A sweep of rotations with one shift; their cosines are real.
void sweep(Eigen::MatrixXcd& h, Index first, Index last, const Complex& shift) {
  for (Index k = first; k < last; ++k) {
    const Complex x = k > first ? h(k, k - 1) : h(first, first) - shift, y = k > first ? h(k + 1, k - 1) : h(k + 1, k);
    const double size_x = std::abs(x), length = std::hypot(size_x, std::abs(y));
    if (length == 0) continue;
    const double c = size_x / length;
    const Complex s = product(size_x > 0 ? x / size_x : 1, std::conj(y)) / length, opposite = std::conj(s);
    for (Index j = std::max(first, k - 1); j <= last; ++j) {
      const Complex above = h(k, j), below = h(k + 1, j);
      h(k, j) = c * above + product(s, below);
      h(k + 1, j) = c * below - product(opposite, above);
    }
    if (k > first) h(k + 1, k - 1) = 0;
    Complex *left = &h(0, k), *right = &h(0, k + 1);
    for (Index i = first; i <= std::min(k + 2, last); ++i) {
      const Complex of_left = left[i], of_right = right[i];
      left[i] = c * of_left + product(opposite, of_right);
      right[i] = c * of_right - product(s, of_left);
    }
  }
}

/// Both eigenvalues of the 2 x 2 block that ends at `last`; the one nearer to its last entry comes second.
template <class Matrix>
std::pair<Complex, Complex> of_pair(const Matrix& h, Index last) {
  const Complex mean = 0.5 * (h(last - 1, last - 1) + h(last, last)),
                half = 0.5 * (h(last - 1, last - 1) - h(last, last));
  const Complex root = std::sqrt(half * half + Complex(h(last - 1, last)) * Complex(h(last, last - 1)));
  const bool is_nearer = std::abs(half + root) < std::abs(half - root);
  return is_nearer ? std::pair(mean - root, mean + root) : std::pair(mean + root, mean - root);
}

void shift_and_sweep(Eigen::MatrixXd& h, Index first, Index last, bool is_stuck) {
  Shifts shifts{h(last - 1, last - 1), h(last, last), h(last - 1, last) * h(last, last - 1)};
  if (is_stuck) {
    const double below = std::abs(h(last, last - 1)) + std::abs(h(last - 1, last - 2));
    shifts = {h(last, last) + 0.75 * below, h(last, last) + 0.75 * below, -0.4375 * below * below};
  }
  sweep(h, first, last, shifts);
}

void shift_and_sweep(Eigen::MatrixXcd& h, Index first, Index last, bool is_stuck) {
  sweep(h, first, last, is_stuck ? h(last, last) + size_of(h(last, last - 1)) : of_pair(h, last).second);
}

/// Empty if the sweeps do not converge.
template <class Matrix>
Eigen::VectorXcd by_sweeps(Matrix h) {
  Eigen::VectorXcd values(h.rows());
  const double nothing = unit * unit * h.cwiseAbs().sum();  // beside zeros: see a nilpotent matrix
  int sweeps = 0;
  for (Index last = h.rows() - 1; last >= 0;) {
    const Index first = first_of_block(h, last, nothing);
    if (first == last) {
      values[last] = h(last, last);
      last -= 1, sweeps = 0;
    } else if (first == last - 1) {
      std::tie(values[last - 1], values[last]) = of_pair(h, last);
      last -= 2, sweeps = 0;
    } else if (++sweeps > most_sweeps) {
      return {};
    } else {
      shift_and_sweep(h, first, last, sweeps % stuck_sweeps == 0);
    }
  }
  return values;
}

}  // namespace

Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXd h) { return by_sweeps(std::move(h)); }
Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXcd h) { return by_sweeps(std::move(h)); }

}  // namespace dpde::stability
