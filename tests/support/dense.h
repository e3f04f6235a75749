// SPDX-License-Identifier: Apache-2.0
// Small dense matrices with plain loops, as oracles for the solvers, which use Eigen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace dpde::test {

struct DenseMatrix {
  std::size_t size = 0;
  std::vector<double> values;  // column-major

  explicit DenseMatrix(std::int64_t n)
      : size(static_cast<std::size_t>(n)), values(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0.0) {}
  double& operator()(std::size_t row, std::size_t column) { return values[row + size * column]; }
  bool operator==(const DenseMatrix&) const = default;
};

void multiply(const DenseMatrix& a, std::span<const double> x, std::span<double> result);
/// By the pseudo-inverse; column remainders below 1e-12 of the largest count as 0.
std::vector<double> solution(const DenseMatrix& a, std::span<const double> b);
/// For a regular matrix.
std::vector<double> regular_solution(const DenseMatrix& a, std::span<const double> b);
/// Of a symmetric matrix, ascending.
std::vector<double> symmetric_eigenvalues(DenseMatrix a);

}  // namespace dpde::test
