// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/banded.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dpde {

BandedMatrix::BandedMatrix(std::int64_t size, std::int64_t width)
    : size_(size),
      width_(width),
      stride_(3 * width + 1),
      values_(static_cast<std::size_t>(size * stride_)),
      pivots_(static_cast<std::size_t>(size)) {}

void BandedMatrix::set_zero() { std::ranges::fill(values_, 0.0); }

std::int64_t BandedMatrix::rows_below(std::int64_t column) const { return std::min(width_, size_ - 1 - column); }

bool BandedMatrix::factor() {
  std::int64_t last = 0;  // last column with an entry in the rows used so far
  for (std::int64_t k = 0; k < size_; ++k) {
    const std::int64_t below = rows_below(k);
    double* const column = &entry(k, k);
    std::int64_t pivot = 0;
    for (std::int64_t i = 1; i <= below; ++i) {
      if (std::abs(column[i]) > std::abs(column[pivot])) pivot = i;
    }
    pivots_[static_cast<std::size_t>(k)] = k + pivot;
    if (column[pivot] == 0 || !std::isfinite(column[pivot])) return false;
    last = std::max(last, std::min(k + width_ + pivot, size_ - 1));
    if (pivot != 0) {
      for (std::int64_t j = k; j <= last; ++j) std::swap(entry(k, j), entry(k + pivot, j));
    }
    for (std::int64_t i = 1; i <= below; ++i) column[i] /= column[0];
    for (std::int64_t j = k + 1; j <= last; ++j) {
      double* const other = &entry(k, j);
      const double factor = other[0];
      if (factor == 0) continue;
      for (std::int64_t i = 1; i <= below; ++i) other[i] -= column[i] * factor;
    }
  }
  return true;
}

void BandedMatrix::solve(std::span<double> x) const {
  const auto at = [&](std::int64_t i) -> double& { return x[static_cast<std::size_t>(i)]; };
  for (std::int64_t k = 0; k < size_; ++k) {
    std::swap(at(k), at(pivots_[static_cast<std::size_t>(k)]));
    const double* const column = &values_[place(k, k)];
    for (std::int64_t i = 1; i <= rows_below(k); ++i) at(k + i) -= column[i] * at(k);
  }
  for (std::int64_t k = size_; k-- > 0;) {
    const double* const column = &values_[place(k, k)];
    at(k) /= column[0];
    for (std::int64_t i = 1; i <= std::min(2 * width_, k); ++i) at(k - i) -= column[-i] * at(k);
  }
}

}  // namespace dpde
