// SPDX-License-Identifier: Apache-2.0
#include "solve/null_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "solve/finite.h"
#include "solve/vector_parts.h"

namespace dpde {
namespace {

/// Cells that are joined by entries, each set named by one of them.
class Joined {
 public:
  explicit Joined(std::size_t cells) : parent_(cells) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t cell) {
    while (parent_[cell] != cell) cell = parent_[cell] = parent_[parent_[cell]];
    return cell;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Of a row or a column.
struct Balance {
  double sum = 0, size = 0, largest = 0;

  void add(double value) {
    sum += value;
    size += std::abs(value);
    largest = std::max(largest, std::abs(value));
  }
  /// Entries that kernels made are off by a few units in the last place of the largest; their sum, here, by those of
  /// f64. More is a term of its own: that of x - k*lap(x) is 1/(4*k) of the diagonal.
  bool is_zero(double rounding) const { return std::abs(sum) <= std::max(8 * rounding * largest, 64 * 0x1p-52 * size); }
};

/// The cells of those parts whose `is_singular`(root) is true.
template <class F>
std::vector<std::vector<std::uint32_t>> singular_parts(Joined& joined, std::size_t cells, const F& is_singular) {
  std::vector<std::vector<std::uint32_t>> parts;
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(cells, none);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t root = joined.root(cell);
    if (!is_singular(root)) continue;
    if (number[root] == none) {
      number[root] = static_cast<std::uint32_t>(parts.size());
      parts.emplace_back();
    }
    parts[number[root]].push_back(cell);
  }
  for (std::vector<std::uint32_t>& part : parts) part.shrink_to_fit();
  return parts;
}

}  // namespace

NullSpace::NullSpace(const StencilMatrix& matrix, double rounding) {
  const auto cells = static_cast<std::size_t>(matrix.size());
  Joined joined(cells);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double) {
    joined.join(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column));
  });
  std::vector<char> rows_are_zero(cells, 1), columns_are_zero(cells, 1);  // at the roots of parts
  for_each_cell(matrix.cells, [&](std::size_t cell, const GridPlace& place) {
    Balance of_row, of_column;
    for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
      if (column_of(matrix, place, matrix.offsets[k]) >= 0) of_row.add(matrix.values[k][cell]);
      std::array<int, 3> back = matrix.offsets[k];
      for (int& along : back) along = -along;
      const std::int64_t row = column_of(matrix, place, back);  // whose entry k is in the column of this cell
      if (row >= 0) of_column.add(matrix.values[k][static_cast<std::size_t>(row)]);
    }
    const std::uint32_t root = joined.root(static_cast<std::uint32_t>(cell));
    if (!of_row.is_zero(rounding)) rows_are_zero[root] = 0;
    if (!of_column.is_zero(rounding)) columns_are_zero[root] = 0;
  });
  const auto is_singular_part = [&](std::uint32_t root) {
    is_lopsided_ = is_lopsided_ || rows_are_zero[root] != columns_are_zero[root];
    return rows_are_zero[root] != 0 && columns_are_zero[root] != 0;
  };
  parts_ = singular_parts(joined, cells, is_singular_part);
}

bool NullSpace::is_singular(const ConstantRows& rows, double rounding) {
  Balance balance;
  for (const double value : rows.row()) balance.add(value);
  const bool has_values = std::ranges::any_of(
      rows.sides(), [](Sides sides) { return sides != Sides::periodic && sides != Sides::even_even; });
  return balance.is_zero(rounding) && !has_values;
}

/// Parts are alike: all are singular, or none is. Where each cell is coupled with the next ones there is one.
NullSpace::NullSpace(const ConstantRows& rows, double rounding) {
  if (!is_singular(rows, rounding)) return;
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
  Joined joined(cells);
  for_each_cell(rows.cells(), [&](std::size_t cell, const GridPlace& place) {
    rows.for_each_entry_of(place, [&](std::size_t column, double value) {
      if (value != 0) joined.join(static_cast<std::uint32_t>(cell), static_cast<std::uint32_t>(column));
    });
  });
  parts_ = singular_parts(joined, cells, [](std::uint32_t) { return true; });
}

void NullSpace::balance(StencilMatrix& matrix) const {
  const auto middle = std::ranges::find(matrix.offsets, std::array{0, 0, 0});
  if (middle == matrix.offsets.end()) return;
  std::vector<double>& diagonal = matrix.values[static_cast<std::size_t>(middle - matrix.offsets.begin())];
  for (const std::vector<std::uint32_t>& part : parts_) {
    for (const std::uint32_t cell : part) {
      double sum = 0;
      for (const std::vector<double>& entries : matrix.values) sum += entries[cell];
      diagonal[cell] -= sum;
    }
  }
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
