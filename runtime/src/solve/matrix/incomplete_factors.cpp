// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/incomplete_factors.h"

#include <algorithm>
#include <cmath>

namespace dpde {

IncompleteFactors::IncompleteFactors(const std::vector<std::vector<std::int64_t>>& columns)
    : place_in_row_(columns.size(), -1) {
  std::size_t entries = 0;
  for (const std::vector<std::int64_t>& row : columns) entries += row.size();
  columns_.reserve(entries);
  begin_.reserve(columns.size() + 1);
  diagonal_.reserve(columns.size());
  begin_.push_back(0);
  for (std::size_t row = 0; row < columns.size(); ++row) {
    const auto own = std::ranges::lower_bound(columns[row], static_cast<std::int64_t>(row));
    diagonal_.push_back(columns_.size() + static_cast<std::size_t>(own - columns[row].begin()));
    columns_.insert(columns_.end(), columns[row].begin(), columns[row].end());
    begin_.push_back(columns_.size());
  }
  values_.assign(columns_.size(), 0.0);
  factors_.assign(columns_.size(), 0.0);
}

void IncompleteFactors::set_zero() { std::ranges::fill(values_, 0.0); }

void IncompleteFactors::set(std::int64_t row, std::int64_t column, double value) {
  const auto first = columns_.begin() + static_cast<std::ptrdiff_t>(begin_[static_cast<std::size_t>(row)]);
  const auto last = columns_.begin() + static_cast<std::ptrdiff_t>(begin_[static_cast<std::size_t>(row) + 1]);
  values_[static_cast<std::size_t>(std::lower_bound(first, last, column) - columns_.begin())] = value;
}

bool IncompleteFactors::factor() {
  factors_ = values_;
  const auto place_of = [&](std::int64_t column) -> std::int64_t& {
    return place_in_row_[static_cast<std::size_t>(column)];
  };
  for (std::size_t row = 0; row < rows(); ++row) {
    for (std::size_t k = begin_[row]; k < begin_[row + 1]; ++k) place_of(columns_[k]) = static_cast<std::int64_t>(k);
    for (std::size_t k = begin_[row]; k < diagonal_[row]; ++k) {
      const auto upper = static_cast<std::size_t>(columns_[k]);
      factors_[k] /= factors_[diagonal_[upper]];
      for (std::size_t j = diagonal_[upper] + 1; j < begin_[upper + 1]; ++j) {
        const std::int64_t place = place_of(columns_[j]);
        if (place >= 0) factors_[static_cast<std::size_t>(place)] -= factors_[k] * factors_[j];
      }
    }
    for (std::size_t k = begin_[row]; k < begin_[row + 1]; ++k) place_of(columns_[k]) = -1;
    const double pivot = factors_[diagonal_[row]];
    if (pivot == 0 || !std::isfinite(pivot)) return false;
  }
  return true;
}

void IncompleteFactors::multiply(std::span<const double> x, std::span<double> result) const {
  for (std::size_t row = 0; row < rows(); ++row) {
    double sum = 0;
    for (std::size_t k = begin_[row]; k < begin_[row + 1]; ++k)
      sum += values_[k] * x[static_cast<std::size_t>(columns_[k])];
    result[row] = sum;
  }
}

void IncompleteFactors::precondition(std::span<const double> right, std::span<double> x) const {
  for (std::size_t row = 0; row < rows(); ++row) {
    double sum = right[row];
    for (std::size_t k = begin_[row]; k < diagonal_[row]; ++k)
      sum -= factors_[k] * x[static_cast<std::size_t>(columns_[k])];
    x[row] = sum;
  }
  for (std::size_t row = rows(); row-- > 0;) {
    double sum = x[row];
    for (std::size_t k = diagonal_[row] + 1; k < begin_[row + 1]; ++k)
      sum -= factors_[k] * x[static_cast<std::size_t>(columns_[k])];
    x[row] = sum / factors_[diagonal_[row]];
  }
}

}  // namespace dpde
