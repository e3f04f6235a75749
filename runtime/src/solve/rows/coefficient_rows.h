// SPDX-License-Identifier: Apache-2.0
// Coefficients of a grid by rows along x. Equal rows are stored once: constant coefficients are a few rows, which stay
// in the first-level cache.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solve/matrix/half_rows.h"
#include "solve/operator/numbers.h"

namespace dpde {

/// Finds rows with equal numbers.
struct RowNumbers {
  /// Gives equal numbers to rows with equal bytes, in order of first occurrence; returns how many there are.
  std::size_t find(std::size_t length, std::span<const double> values);

  std::vector<std::uint32_t> of_row, table;  // of each row; hash table of rows
};

template <class Real>
class CoefficientRows {
 public:
  /// `values`: of all cells, row by row; multiplied by `factor`. Memory of earlier values is reused.
  void set(const HalfRows& rows, std::span<const double> values, double factor = 1);

  const Real* const* rows() const { return rows_.data(); }
  const Real* row(std::int64_t number) const { return rows_[static_cast<std::size_t>(number)]; }

 private:
  std::vector<const Real*> rows_;
  RowNumbers numbers_;
  NumbersOf<Real> kept_;
};

extern template class CoefficientRows<double>;
extern template class CoefficientRows<float>;

}  // namespace dpde
