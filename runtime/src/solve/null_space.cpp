// SPDX-License-Identifier: Apache-2.0
#include "solve/null_space.h"

#include <algorithm>
#include <array>
#include <cmath>
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

}  // namespace

NullSpace::NullSpace(const StencilMatrix& matrix, double rounding) {
  const auto cells = static_cast<std::size_t>(matrix.size());
  std::vector<Balance> row_balance(cells), column_balance(cells);
  Joined joined(cells);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    row_balance[row].add(value);
    column_balance[column].add(value);
    joined.join(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column));
  });
  std::vector<char> rows_are_zero(cells, 1), columns_are_zero(cells, 1);  // at the roots of parts
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t root = joined.root(cell);
    if (!row_balance[cell].is_zero(rounding)) rows_are_zero[root] = 0;
    if (!column_balance[cell].is_zero(rounding)) columns_are_zero[root] = 0;
  }
  std::vector<std::int64_t> number(cells, -1);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t root = joined.root(cell);
    is_lopsided_ = is_lopsided_ || rows_are_zero[root] != columns_are_zero[root];
    if (rows_are_zero[root] == 0 || columns_are_zero[root] == 0) continue;
    if (number[root] < 0) {
      number[root] = static_cast<std::int64_t>(parts_.size());
      parts_.emplace_back();
    }
    parts_[static_cast<std::size_t>(number[root])].push_back(cell);
  }
}

StencilMatrix NullSpace::balanced(StencilMatrix matrix) const {
  if (parts_.empty()) return matrix;
  std::vector<double> sum(static_cast<std::size_t>(matrix.size()), 0.0);
  for_each_entry(matrix, [&](std::size_t row, std::size_t, double value) { sum[row] += value; });
  const auto middle = std::ranges::find(matrix.offsets, std::array{0, 0, 0});
  if (middle == matrix.offsets.end()) return matrix;
  std::vector<double>& diagonal = matrix.values[static_cast<std::size_t>(middle - matrix.offsets.begin())];
  for (const std::vector<std::uint32_t>& part : parts_) {
    for (const std::uint32_t cell : part) diagonal[cell] -= sum[cell];
  }
  return matrix;
}

double NullSpace::share_of_mean(std::span<const double> values, const Team& team) const {
  if (parts_.empty()) return 0;
  const auto [sum, squares] = sums_of(values, team);
  return squares == 0 ? 0 : std::abs(sum) / std::sqrt(squares * static_cast<double>(values.size()));
}

double NullSpace::remove(std::span<double> values, const Team& team) const {
  if (parts_.empty()) return 0;
  if (parts_.front().size() == values.size()) {
    const auto [sum, squares] = sums_of(values, team);
    const double count = static_cast<double>(values.size()), mean = sum / count;
    set_each(
        team, values, [mean](double value) { return value - mean; }, values);
    return squares == 0 ? 0 : std::abs(sum) / std::sqrt(squares * count);
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
