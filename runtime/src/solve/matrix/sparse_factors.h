// SPDX-License-Identifier: Apache-2.0
// Factors of a sparse matrix, with columns in an order that fills little (COLAMD): of systems whose band is wide.
#pragma once

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

class SparseFactors {
 public:
  /// Of each row its columns in ascending order.
  explicit SparseFactors(const std::vector<std::vector<std::int64_t>>& columns);
  explicit SparseFactors(const Eigen::SparseMatrix<double>& matrix) : matrix_(matrix) {}

  void set_zero();
  void set(std::int64_t row, std::int64_t column, double value);
  /// Null where there is none.
  double* entry(std::int64_t row, std::int64_t column);
  double largest_column() const;  // norm
  /// False where it is singular or not finite.
  bool factor();
  void solve(std::span<const double> right, std::span<double> x) const;
  /// Of memory, with the factors that are not there yet: an estimate. Of a plane about 31/4*n*log2(n) entries (George,
  /// SIAM J. Numer. Anal. 10, 1973, 345), of which both have as many.
  std::int64_t bytes() const;

 private:
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> factors_;
  bool has_order_ = false;  // which depends on where entries are alone
};

}  // namespace dpde
