// SPDX-License-Identifier: Apache-2.0
// Coefficients of a grid by rows along x. Rows with the same numbers are kept once: where coefficients are constant
// they are a few rows, which stay in the first cache.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solve/matrix/half_rows.h"
#include "solve/operator/numbers.h"

namespace dpde {

/// Which rows have the same numbers.
struct RowNumbers {
  /// The same number for rows of the same bytes, in the order in which they come; how many there are.
  std::size_t find(std::size_t length, std::span<const double> values);

  std::vector<std::uint32_t> of_row, table;  // of each row; rows by their hash
};

template <class Real>
class CoefficientRows {
 public:
  /// `values`: of all cells, row behind row, which are multiplied by `factor`. Memory of values before is used again.
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
