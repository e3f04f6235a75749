// SPDX-License-Identifier: Apache-2.0
// Small dense systems with plain loops: the equivalent decomposition of Eigen takes seven seconds to compile.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace dpde {

/// Square, column-major.
struct DenseMatrix {
  explicit DenseMatrix(std::size_t rows) : size(rows), values(rows * rows, 0.0) {}
  std::span<double> column(std::size_t j) { return std::span(values).subspan(j * size, size); }
  std::span<const double> column(std::size_t j) const { return std::span(values).subspan(j * size, size); }

  std::size_t size;
  std::vector<double> values;
};

/// I - factor*v*v^T, where v has `first` at `head` and `rest` from `tail` on.
struct Reflection {
  std::size_t head, tail;
  double first, factor;
  std::vector<double> rest;
  void apply(std::span<double> x) const;
};

/// The pseudo-inverse by a complete orthogonal decomposition A*P = Q*[T 0]*Z with triangular T (G. H. Golub and C. F.
/// Van Loan, Matrix Computations, 5.4.7).
class PseudoInverse {
 public:
  /// Column remainders below `threshold` times the largest column count as 0.
  PseudoInverse(DenseMatrix a, double threshold);
  /// The x of smallest norm that minimises |A*x - b|.
  std::vector<double> solve(std::vector<double> b) const;

 private:
  void pivot(std::size_t k);
  void reduce_columns(double threshold);
  void reduce_rows();

  DenseMatrix a_;                         // T in its first rows and columns
  std::vector<std::size_t> order_;        // permutation P of the columns
  std::vector<Reflection> left_, right_;  // Q in forward order, Z^T in backward order
};

}  // namespace dpde
