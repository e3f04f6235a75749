// SPDX-License-Identifier: Apache-2.0
// Small dense matrices, as oracles of solvers; Eigen does the work, and is compiled once.
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
/// By the pseudo-inverse; singular values below 1e-12 of the largest count as 0.
std::vector<double> solution(const DenseMatrix& a, std::span<const double> b);
/// By partial pivoting, of a regular matrix.
std::vector<double> regular_solution(const DenseMatrix& a, std::span<const double> b);
/// Of a symmetric matrix, in rising order.
std::vector<double> symmetric_eigenvalues(const DenseMatrix& a);

}  // namespace dpde::test
