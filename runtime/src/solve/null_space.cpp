// SPDX-License-Identifier: Apache-2.0
#include "solve/null_space.h"

#include <cmath>
#include <numeric>
#include <utility>

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

struct Sums {
  double rows = 0, columns = 0, size = 0;  // the largest sum of a row, of a column, of the magnitudes of a row
};

}  // namespace

NullSpace::NullSpace(const StencilMatrix& matrix, double rounding) {
  const auto cells = static_cast<std::size_t>(matrix.size());
  std::vector<double> row_sum(cells, 0.0), column_sum(cells, 0.0), row_size(cells, 0.0);
  Joined joined(cells);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    row_sum[row] += value;
    column_sum[column] += value;
    row_size[row] += std::abs(value);
    joined.join(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column));
  });
  std::vector<Sums> sums(cells);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    Sums& of_part = sums[joined.root(cell)];
    of_part.rows = std::max(of_part.rows, std::abs(row_sum[cell]));
    of_part.columns = std::max(of_part.columns, std::abs(column_sum[cell]));
    of_part.size = std::max(of_part.size, row_size[cell]);
  }
  std::vector<std::int64_t> number(cells, -1);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t root = joined.root(cell);
    const double zero = 64 * rounding * sums[root].size;
    const bool rows = sums[root].rows <= zero, columns = sums[root].columns <= zero;
    is_lopsided_ = is_lopsided_ || rows != columns;
    if (!rows || !columns) continue;
    if (number[root] < 0) {
      number[root] = static_cast<std::int64_t>(parts_.size());
      parts_.emplace_back();
    }
    parts_[static_cast<std::size_t>(number[root])].push_back(cell);
  }
}

double NullSpace::remove(std::span<double> values) const {
  if (parts_.empty()) return 0;
  double whole = 0, removed = 0;
  for (const double value : values) whole += value * value;
  for (const std::vector<std::uint32_t>& part : parts_) {
    double sum = 0;
    for (const std::uint32_t cell : part) sum += values[cell];
    const double mean = sum / static_cast<double>(part.size());
    for (const std::uint32_t cell : part) values[cell] -= mean;
    removed += mean * mean * static_cast<double>(part.size());
  }
  return whole == 0 ? 0 : std::sqrt(removed / whole);
}

}  // namespace dpde
