// SPDX-License-Identifier: Apache-2.0
// Small dense matrices, as oracles of solvers, by plain loops: the solvers themselves are by Eigen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dpde::test {

struct DenseMatrix {
  std::size_t size = 0;
  std::vector<double> values;  // by columns

  explicit DenseMatrix(std::int64_t n)
      : size(static_cast<std::size_t>(n)), values(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0.0) {}
  double& operator()(std::size_t row, std::size_t column) { return values[row + size * column]; }
  bool operator==(const DenseMatrix&) const = default;
};

void multiply(const DenseMatrix& a, std::span<const double> x, std::span<double> result);
/// By the pseudo-inverse; what is left of columns is 0 below 1e-12 of the largest.
std::vector<double> solution(const DenseMatrix& a, std::span<const double> b);
/// Of a regular matrix.
std::vector<double> regular_solution(const DenseMatrix& a, std::span<const double> b);
/// Of a symmetric matrix, in rising order.
std::vector<double> symmetric_eigenvalues(DenseMatrix a);

}  // namespace dpde::test
