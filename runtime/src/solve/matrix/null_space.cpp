// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/null_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "solve/operator/finite.h"
#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

/// Union-find: sets of cells joined by entries, each named by one of its cells.
class Joined {
 public:
  Joined(std::size_t cells, std::vector<std::uint32_t>& parents) : parent_(parents) {
    parent_.resize(cells);
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t root(std::uint32_t cell) {
    while (parent_[cell] != cell) cell = parent_[cell] = parent_[parent_[cell]];
    return cell;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t>& parent_;
};

constexpr std::uint32_t no_number = std::numeric_limits<std::uint32_t>::max();

/// Whether the sum of a column may be rounding of its entries.
bool may_be_zero(const StencilMatrix& matrix, const GridPlace& cell, double rounding) {
  double sum = 0, size = 0, largest = 0;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    std::array<int, 3> back = matrix.offsets[k];
    for (int& along : back) along = -along;
    const std::int64_t row = column_of(matrix, cell, back);  // entry k of that row is in the column of this cell
    if (row < 0) continue;
    const double value = matrix.values[k][static_cast<std::size_t>(row)];
    sum += value;
    size += std::abs(value);
    largest = std::max(largest, std::abs(value));
  }
  return std::abs(sum) <= std::max(8 * rounding * largest, 64 * 0x1p-52 * size);
}

/// For parts whose columns may sum to 0 and whose rows do not. The sums of rows are more accurate; their total is that
/// of all entries, so also that of the columns.
void drop_parts_that_sum(Joined& joined, std::span<const double> sums, double zero, NullSpaceMemory& memory) {
  std::vector<std::uint32_t>& number = memory.numbers;
  number.assign(sums.size(), no_number);
  memory.totals.clear();
  for (std::uint32_t cell = 0; cell < sums.size(); ++cell) {
    const std::uint32_t root = joined.root(cell);
    if (memory.rows_are_zero[root] != 0 || memory.columns_are_zero[root] == 0) continue;
    if (number[root] == no_number) {
      number[root] = static_cast<std::uint32_t>(memory.totals.size());
      memory.totals.emplace_back();
    }
    NullSpaceMemory::Total& total = memory.totals[number[root]];
    total.sum += sums[cell];
    total.size += std::abs(sums[cell]);
  }
  for (std::size_t root = 0; root < number.size(); ++root) {
    if (number[root] == no_number) continue;
    const NullSpaceMemory::Total& total = memory.totals[number[root]];
    if (std::abs(total.sum) > zero * total.size) memory.columns_are_zero[root] = 0;
  }
}

/// The cells of the parts for which `is_singular`(root) is true.
template <class F>
void find_singular_parts(Joined& joined, std::size_t cells, std::vector<std::uint32_t>& number, const F& is_singular,
                         std::vector<std::vector<std::uint32_t>>& parts) {
  number.assign(cells, no_number);
  std::size_t count = 0;
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t root = joined.root(cell);
    if (!is_singular(root)) continue;
    if (number[root] == no_number) {
      number[root] = static_cast<std::uint32_t>(count++);
      if (parts.size() < count) parts.emplace_back();
      parts[count - 1].clear();
    }
    parts[number[root]].push_back(cell);
  }
  parts.resize(count);
  for (std::vector<std::uint32_t>& part : parts) part.shrink_to_fit();
}

}  // namespace

void NullSpace::find(const StencilMatrix& matrix, std::span<const double> sums, double rounding,
                     const OperatorKnowledge& known, NullSpaceMemory& memory) {
  const auto cells = static_cast<std::size_t>(matrix.size());
  Joined joined(cells, memory.parents);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double) {
    joined.join(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column));
  });
  std::vector<char>&rows_are_zero = memory.rows_are_zero, &columns_are_zero = memory.columns_are_zero;
  rows_are_zero.assign(cells, 1);
  columns_are_zero.assign(cells, 1);
  for_each_cell(matrix.cells, [&](std::size_t cell, const GridPlace& place) {
    const std::uint32_t root = joined.root(static_cast<std::uint32_t>(cell));
    if (sums[cell] != 0) rows_are_zero[root] = 0;
    const bool is_known = known.is_symmetric || known.sums_to_zero;
    if (!is_known && columns_are_zero[root] != 0 && !may_be_zero(matrix, place, rounding)) columns_are_zero[root] = 0;
  });
  if (known.is_symmetric) columns_are_zero = rows_are_zero;
  if (!known.sums_to_zero) drop_parts_that_sum(joined, sums, std::sqrt(rounding), memory);
  is_lopsided_ = false;
  const auto is_singular_part = [&](std::uint32_t root) {
    is_lopsided_ = is_lopsided_ || rows_are_zero[root] != columns_are_zero[root];
    return rows_are_zero[root] != 0 && columns_are_zero[root] != 0;
  };
  find_singular_parts(joined, cells, memory.numbers, is_singular_part, parts_);
}

/// All parts are alike: all singular, or none. If each cell is coupled with the next ones there is only one.
NullSpace::NullSpace(const ConstantRows& rows) {
  if (!rows.take_constants_to_zero()) return;
  const auto cells = static_cast<std::size_t>(rows.size());
  bool is_one = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<int, 3> next{};
    next[axis] = 1;
    is_one = is_one && (rows.cells()[axis] == 1 || rows.entry(next) != 0);
  }
  if (is_one) {
    std::vector<std::uint32_t>& all = parts_.emplace_back(cells);
    std::iota(all.begin(), all.end(), 0U);
    return;
  }
  NullSpaceMemory memory;
  Joined joined(cells, memory.parents);
  for_each_cell(rows.cells(), [&](std::size_t cell, const GridPlace& place) {
    rows.for_each_entry_of(place, [&](std::size_t column, double value) {
      if (value != 0) joined.join(static_cast<std::uint32_t>(cell), static_cast<std::uint32_t>(column));
    });
  });
  find_singular_parts(
      joined, cells, memory.numbers, [](std::uint32_t) { return true; }, parts_);
}

double NullSpace::share_of_mean(const Sums& sums, std::size_t count) const {
  if (parts_.empty() || sums.squares == 0) return 0;
  return std::abs(sums.sum) / std::sqrt(sums.squares * static_cast<double>(count));
}

double NullSpace::remove(std::span<double> values, const Team& team) const {
  if (parts_.empty()) return 0;
  if (parts_.front().size() == values.size()) {
    const Sums sums = sums_of(values, team);
    const double mean = sums.sum / static_cast<double>(values.size());
    set_each(
        team, values, [mean](double value) { return value - mean; }, values);
    return share_of_mean(sums, values.size());
  }
  const double whole = sums_of(values, team).squares;
  double removed = 0;
  for (const std::vector<std::uint32_t>& part : parts_) {
    const double mean = remove_mean(team, values, part);
    removed += mean * mean * static_cast<double>(part.size());
  }
  return whole == 0 ? 0 : std::sqrt(removed / whole);
}

}  // namespace dpde
