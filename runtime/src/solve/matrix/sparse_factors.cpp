// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/sparse_factors.h"

#include <algorithm>
#include <cmath>

namespace dpde {

SparseFactors::SparseFactors(const std::vector<std::vector<std::int64_t>>& columns)
    : matrix_(static_cast<Eigen::Index>(columns.size()), static_cast<Eigen::Index>(columns.size())) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t row = 0; row < columns.size(); ++row) {
    for (const std::int64_t column : columns[row])
      entries.emplace_back(static_cast<int>(row), static_cast<int>(column), 0.0);
  }
  matrix_.setFromTriplets(entries.begin(), entries.end());
}

void SparseFactors::set_zero() { std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0); }

void SparseFactors::set(std::int64_t row, std::int64_t column, double value) { matrix_.coeffRef(row, column) = value; }

double* SparseFactors::entry(std::int64_t row, std::int64_t column) {
  const int* const rows = matrix_.innerIndexPtr();
  const int* const columns = matrix_.outerIndexPtr();
  const int* const begin = rows + columns[column];
  const int* const end = rows + columns[column + 1];
  const int* const found = std::lower_bound(begin, end, static_cast<int>(row));
  return found == end || *found != row ? nullptr : matrix_.valuePtr() + (found - rows);
}

double SparseFactors::largest_column() const {
  double size = 0;
  for (Eigen::Index column = 0; column < matrix_.cols(); ++column) size = std::max(size, matrix_.col(column).norm());
  return size;
}

bool SparseFactors::factor() {
  const Eigen::Map<const Eigen::ArrayXd> values(matrix_.valuePtr(), matrix_.nonZeros());
  if (!values.isFinite().all()) return false;
  if (!has_order_) factors_.analyzePattern(matrix_);
  has_order_ = true;
  factors_.factorize(matrix_);
  return factors_.info() == Eigen::Success;
}

std::int64_t SparseFactors::bytes() const {
  constexpr double entry = 12;  // bytes: a number and its index
  const auto rows = static_cast<double>(matrix_.rows());
  const double filled = 2 * 7.75 * rows * std::log2(std::max(rows, 2.0));
  return static_cast<std::int64_t>(entry * (static_cast<double>(matrix_.nonZeros()) + filled));
}

void SparseFactors::solve(std::span<const double> right, std::span<double> x) const {
  const auto size = static_cast<Eigen::Index>(right.size());
  Eigen::Map<Eigen::VectorXd>(x.data(), size) = factors_.solve(Eigen::Map<const Eigen::VectorXd>(right.data(), size));
}

}  // namespace dpde
