// SPDX-License-Identifier: Apache-2.0
#include "support/dense.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace dpde::test {

namespace {

using Vector = Eigen::Map<const Eigen::VectorXd>;

Eigen::Map<const Eigen::MatrixXd> matrix_of(const DenseMatrix& a) {
  const auto size = static_cast<Eigen::Index>(a.size);
  return {a.values.data(), size, size};
}
Vector vector_of(std::span<const double> x) { return {x.data(), static_cast<Eigen::Index>(x.size())}; }
std::vector<double> numbers_of(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

}  // namespace

void multiply(const DenseMatrix& a, std::span<const double> x, std::span<double> result) {
  Eigen::Map<Eigen::VectorXd>(result.data(), static_cast<Eigen::Index>(result.size())).noalias() =
      matrix_of(a) * vector_of(x);
}

std::vector<double> solution(const DenseMatrix& a, std::span<const double> b) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  inverse.setThreshold(1e-12);
  return numbers_of(inverse.compute(matrix_of(a)).solve(vector_of(b)));
}

std::vector<double> regular_solution(const DenseMatrix& a, std::span<const double> b) {
  return numbers_of(matrix_of(a).partialPivLu().solve(vector_of(b)));
}

std::vector<double> symmetric_eigenvalues(const DenseMatrix& a) {
  return numbers_of(matrix_of(a).selfadjointView<Eigen::Lower>().eigenvalues());
}

}  // namespace dpde::test
