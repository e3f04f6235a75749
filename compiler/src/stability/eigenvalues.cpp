// SPDX-License-Identifier: Apache-2.0
#include "stability/eigenvalues.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>

namespace dpde::stability {

namespace {

constexpr int most_on_stack = 4;

/// E. E. Osborne, "On pre-conditioning of matrices", J. ACM 7 (1960): by powers of two, in the 1-norm.
void balance(Eigen::MatrixXcd& a) {
  for (int sweep = 0; sweep < 20; ++sweep) {
    bool has_changed = false;
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const double own = std::abs(a(i, i));
      const double row = a.row(i).cwiseAbs().sum() - own, column = a.col(i).cwiseAbs().sum() - own;
      if (!(row > 0) || !(column > 0)) continue;
      const double factor = std::exp2(std::round(0.5 * std::log2(row / column)));
      if (factor == 1) continue;
      a.row(i) /= factor;
      a.col(i) *= factor;
      has_changed = true;
    }
    if (!has_changed) return;
  }
}

/// Memory for the largest of them is on the stack.
using Small = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, 0, most_on_stack, most_on_stack>;

}  // namespace

Eigen::VectorXcd eigenvalues(Eigen::MatrixXcd a) {
  if (a.rows() == 1) return a.col(0);
  if (a.rows() == 2) {
    const std::complex<double> mean = 0.5 * (a(0, 0) + a(1, 1)), half = 0.5 * (a(0, 0) - a(1, 1));
    const std::complex<double> root = std::sqrt(half * half + a(0, 1) * a(1, 0));
    return Eigen::Vector2cd(mean + root, mean - root);
  }
  balance(a);
  if (a.rows() <= most_on_stack) return Eigen::ComplexEigenSolver<Small>(Small(a), false).eigenvalues();
  return Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(a, false).eigenvalues();
}

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& a) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(a, false).eigenvalues();
}

Eigen::Index largest_component(const Eigen::MatrixXcd& a) {
  const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> solver(a);
  Eigen::Index of_all = 0, component = 0;
  solver.eigenvalues().cwiseAbs().maxCoeff(&of_all);
  solver.eigenvectors().col(of_all).cwiseAbs().maxCoeff(&component);
  return component;
}

}  // namespace dpde::stability
