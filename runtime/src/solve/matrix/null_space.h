// SPDX-License-Identifier: Apache-2.0
// The null spaces of operators whose rows and columns sum to 0: the constants on each isolated part of the grid, as
// between walls without flux, on a periodic axis, in a region cut off by an obstacle. A cell without entries is such a
// part.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/operator/finite.h"
#include "solve/rows/constant_rows.h"
#include "solve/rows/row_sums.h"

namespace dpde {

/// Work memory of a search for null spaces: 10 bytes a cell, 16 more for each part whose columns may sum to 0.
struct NullSpaceMemory {
  struct Total {
    double sum = 0, size = 0;
  };
  std::vector<std::uint32_t> parents, numbers;
  std::vector<char> rows_are_zero, columns_are_zero;  // at the roots of parts
  std::vector<Total> totals;
};

class NullSpace {
 public:
  NullSpace() = default;
  /// `sums`: those of its rows (solve/rows/row_sums.h). Unless `known` says more, columns count as summing to 0 if
  /// their sums may be rounding of entries and the more accurate sums of rows cancel: both have the same total.
  NullSpace(const StencilMatrix& matrix, std::span<const double> sums, double rounding,
            const OperatorKnowledge& known = {}) {
    NullSpaceMemory memory;
    find(matrix, sums, rounding, known, memory);
  }
  /// The same in place, reusing its memory.
  void find(const StencilMatrix& matrix, std::span<const double> sums, double rounding, const OperatorKnowledge& known,
            NullSpaceMemory& memory);
  /// For a matrix without further knowledge; `rounding`: relative error of the entries.
  NullSpace(const StencilMatrix& matrix, double rounding) : NullSpace(matrix, row_sums(matrix, rounding), rounding) {}
  /// For constant rows that map constants to 0.
  explicit NullSpace(const ConstantRows& rows);

  /// Subtracts the mean over each singular part; returns |removed part|/|values|.
  double remove(std::span<double> values, const Team& team = 1) const;
  /// The same ratio, if the removed part is a mean over all cells; `values` are not changed.
  double share_of_mean(std::span<const double> values, const Team& team = 1) const {
    return parts_.empty() ? 0 : share_of_mean(sums_of(values, team), values.size());
  }
  /// For `count` values with these sums.
  double share_of_mean(const Sums& sums, std::size_t count) const;

  bool is_empty() const { return parts_.empty(); }
  /// Whether in some part rows sum to 0 and columns do not, or vice versa.
  bool is_lopsided() const { return is_lopsided_; }
  const std::vector<std::vector<std::uint32_t>>& parts() const { return parts_; }
  bool operator==(const NullSpace&) const = default;

 private:
  std::vector<std::vector<std::uint32_t>> parts_;  // cells of each singular part, in order
  bool is_lopsided_ = false;
};

}  // namespace dpde
