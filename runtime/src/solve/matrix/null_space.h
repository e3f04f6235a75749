// SPDX-License-Identifier: Apache-2.0
// The null spaces of operators whose rows and columns sum to 0: a constant in each part of the grid that is by itself,
// as between walls through which nothing flows, around a ring, in what an obstacle cuts off. Cells without entries are
// such parts, of one cell.
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

/// What a search for null spaces works in: 10 bytes a cell, 16 more for each part whose columns may sum to 0.
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
  /// `sums`: of its rows (solve/row_sums.h). Where `known` does not say more, columns sum to 0 where what they sum to
  /// may be rounding of entries and the sums of rows, which are more exact, cancel: those of all entries are the same.
  NullSpace(const StencilMatrix& matrix, std::span<const double> sums, double rounding,
            const OperatorKnowledge& known = {}) {
    NullSpaceMemory memory;
    find(matrix, sums, rounding, known, memory);
  }
  /// The same in place of what it was, in its memory.
  void find(const StencilMatrix& matrix, std::span<const double> sums, double rounding, const OperatorKnowledge& known,
            NullSpaceMemory& memory);
  /// Of a matrix that is all that is known; `rounding`: relative error of the entries.
  NullSpace(const StencilMatrix& matrix, double rounding) : NullSpace(matrix, row_sums(matrix, rounding), rounding) {}
  /// Where of a constant the rows make 0.
  explicit NullSpace(const ConstantRows& rows);

  /// Takes the mean over each singular part away; |what is taken|/|values|.
  double remove(std::span<double> values, const Team& team = 1) const;
  /// That |what is taken|/|values|, where it is a mean over all cells; they stay.
  double share_of_mean(std::span<const double> values, const Team& team = 1) const {
    return parts_.empty() ? 0 : share_of_mean(sums_of(values, team), values.size());
  }
  /// Of so many values with these sums.
  double share_of_mean(const Sums& sums, std::size_t count) const;

  bool is_empty() const { return parts_.empty(); }
  /// Whether there are parts where rows sum to 0 and columns do not, or the other way round.
  bool is_lopsided() const { return is_lopsided_; }
  const std::vector<std::vector<std::uint32_t>>& parts() const { return parts_; }
  bool operator==(const NullSpace&) const = default;

 private:
  std::vector<std::vector<std::uint32_t>> parts_;  // cells of each singular part, in order
  bool is_lopsided_ = false;
};

}  // namespace dpde
