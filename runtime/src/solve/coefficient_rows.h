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
  /// `values`: of all cells, row behind row. Memory of values before is used again.
  void set(const HalfRows& rows, std::span<const double> values);

  const double* const* rows() const { return rows_.data(); }
  const double* row(std::int64_t number) const { return rows_[static_cast<std::size_t>(number)]; }

 private:
  std::size_t number_rows(std::size_t length, std::span<const double> values);

  std::vector<const double*> rows_;
  std::vector<std::uint32_t> number_, table_;  // of each row, among the kept ones; of rows by their hash
  Numbers kept_;
};

}  // namespace dpde
