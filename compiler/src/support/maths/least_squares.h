// SPDX-License-Identifier: Apache-2.0
// Small dense systems by plain loops: Eigen's decomposition, which does the same, takes seven seconds to compile.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace dpde {

/// Square, column by column.
struct DenseMatrix {
  explicit DenseMatrix(std::size_t rows) : size(rows), values(rows * rows, 0.0) {}
  std::span<double> column(std::size_t j) { return std::span(values).subspan(j * size, size); }
  std::span<const double> column(std::size_t j) const { return std::span(values).subspan(j * size, size); }

  std::size_t size;
  std::vector<double> values;
};

/// I - factor*v*v^T, where v is `first` at `head` and `rest` from `tail` on.
struct Reflection {
  std::size_t head, tail;
  double first, factor;
  std::vector<double> rest;
  void apply(std::span<double> x) const;
};

/// The pseudo-inverse by the complete orthogonal decomposition A*P = Q*[T 0]*Z, T a triangle (G. H. Golub and
/// C. F. Van Loan, Matrix Computations, 5.4.7).
class PseudoInverse {
 public:
  /// What is left of columns is 0 below `threshold` times the largest column.
  PseudoInverse(DenseMatrix a, double threshold);
  /// The smallest of the x for which |A*x - b| is smallest.
  std::vector<double> solve(std::vector<double> b) const;

 private:
  void pivot(std::size_t k);
  void reduce_columns(double threshold);
  void reduce_rows();

  DenseMatrix a_;                         // T in its first rows and columns
  std::vector<std::size_t> order_;        // of the columns: P
  std::vector<Reflection> left_, right_;  // Q from the first on, Z^T from the last on
};

}  // namespace dpde
