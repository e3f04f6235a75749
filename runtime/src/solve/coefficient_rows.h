// SPDX-License-Identifier: Apache-2.0
// Coefficients of a grid by rows along x. Rows with the same numbers are kept once: where coefficients are constant
// they are a few rows, which stay in the first cache.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solve/half_rows.h"
#include "solve/numbers.h"

namespace dpde {

class CoefficientRows {
 public:
  CoefficientRows() = default;
  /// `values`: of all cells, row behind row.
  CoefficientRows(const HalfRows& rows, std::span<const double> values);

  const double* const* rows() const { return rows_.data(); }
  const double* row(std::int64_t number) const { return rows_[static_cast<std::size_t>(number)]; }

 private:
  std::vector<const double*> rows_;
  Numbers kept_;
};

}  // namespace dpde
