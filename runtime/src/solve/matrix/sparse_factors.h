// SPDX-License-Identifier: Apache-2.0
// LU factors of a sparse matrix in a column order with little fill-in (COLAMD), for systems with a wide band.
#pragma once

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

class SparseFactors {
 public:
  /// `columns`: those of each row in ascending order.
  explicit SparseFactors(const std::vector<std::vector<std::int64_t>>& columns);
  explicit SparseFactors(const Eigen::SparseMatrix<double>& matrix) : matrix_(matrix) {}

  void set_zero();
  void set(std::int64_t row, std::int64_t column, double value);
  /// Null if there is no such entry.
  double* entry(std::int64_t row, std::int64_t column);
  double largest_column() const;  // norm
  /// Returns false if it is singular or not finite.
  bool factor();
  void solve(std::span<const double> right, std::span<double> x) const;
  /// Memory use, including factors not yet computed: an estimate. In 2-D each factor has about 31/4*n*log2(n) entries
  /// (George, SIAM J. Numer. Anal. 10, 1973, 345).
  std::int64_t bytes() const;

 private:
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> factors_;
  bool has_order_ = false;  // depends only on the positions of the entries
};

}  // namespace dpde
