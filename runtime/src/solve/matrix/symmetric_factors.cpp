// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/symmetric_factors.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "solve/matrix/held_cells.h"

namespace dpde {

bool SymmetricFactors::find(std::span<const double> sums) {
  null_space_.find(matrix_, sums, 0x1p-52, {.is_symmetric = true}, memory_);
  if (sums.size() <= few) return invert();
  const bool is_found = factor();
  matrix_ = {};
  memory_ = {};
  return is_found;
}

/// In-place Gauss-Jordan without pivoting, since the matrix is definite apart from fixed cells. Their rows and columns
/// stay 0.
bool SymmetricFactors::invert() {
  const auto n = static_cast<std::size_t>(matrix_.size());
  std::array<bool, few> is_held{};
  for (const auto& part : null_space_.parts()) is_held[part.front()] = true;
  inverse_.assign(n * n, 0.0);
  for_each_entry(matrix_, [&](std::size_t row, std::size_t column, double value) {
    if (!is_held[row] && !is_held[column]) inverse_[row * n + column] += value;
  });
  for (std::size_t k = 0; k < n; ++k) {
    if (is_held[k]) continue;
    double* const pivot_row = inverse_.data() + k * n;
    const double pivot = pivot_row[k];
    if (pivot == 0 || !std::isfinite(pivot)) return false;
    pivot_row[k] = 1;
    for (std::size_t j = 0; j < n; ++j) pivot_row[j] /= pivot;
    for (std::size_t i = 0; i < n; ++i) {
      double* const row = inverse_.data() + i * n;
      const double factor = row[k];
      if (i == k || factor == 0) continue;
      row[k] = 0;
      for (std::size_t j = 0; j < n; ++j) row[j] -= factor * pivot_row[j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {  // restores symmetry, which rounding has disturbed
    for (std::size_t j = 0; j < i; ++j)
      inverse_[i * n + j] = inverse_[j * n + i] = (inverse_[i * n + j] + inverse_[j * n + i]) / 2;
  }
  return true;
}

bool SymmetricFactors::factor() {
  const auto [free, sparse] = without_held_cells(matrix_, null_space_);
  cells_.resize(free.size());
  if (free.empty()) return true;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(sparse);
  if (factors.info() != Eigen::Success || !(factors.vectorD().array() != 0).all()) return false;
  lower_ = factors.matrixL().nestedExpression();
  inverse_.resize(free.size());
  values_.resize(free.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    inverse_[i] = 1 / factors.vectorD()[static_cast<Eigen::Index>(i)];
    const auto row = static_cast<std::size_t>(factors.permutationP().indices()[static_cast<Eigen::Index>(i)]);
    cells_[row] = free[i];
  }
  return true;
}

void SymmetricFactors::solve(std::span<double> b, std::span<double> x) {
  null_space_.remove(b);
  if (b.size() <= few) {
    for (std::size_t row = 0; row < b.size(); ++row) {
      double sum = 0;
      const double* const of_row = inverse_.data() + row * b.size();
      for (std::size_t i = 0; i < b.size(); ++i) sum += of_row[i] * b[i];
      x[row] = sum;
    }
  } else {
    solve_by_factors(b, x);
  }
  null_space_.remove(x);
}

void SymmetricFactors::solve_by_factors(std::span<const double> b, std::span<double> x) {
  std::ranges::fill(x, 0.0);
  const auto size = static_cast<Eigen::Index>(cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) values_[i] = b[cells_[i]];
  for (Eigen::Index column = 0; column < size; ++column) {
    const double value = values_[static_cast<std::size_t>(column)];
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower_, column); entry; ++entry) {
      if (entry.row() > column) values_[static_cast<std::size_t>(entry.row())] -= entry.value() * value;
    }
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) values_[i] *= inverse_[i];
  for (Eigen::Index column = size; column-- > 0;) {
    double& value = values_[static_cast<std::size_t>(column)];
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower_, column); entry; ++entry) {
      if (entry.row() > column) value -= entry.value() * values_[static_cast<std::size_t>(entry.row())];
    }
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) x[cells_[i]] = values_[i];
}

}  // namespace dpde
