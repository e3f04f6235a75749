// SPDX-License-Identifier: Apache-2.0
// A linear operator on the cells of a grid as a stencil that may differ from cell to cell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

/// Cells are numbered x + cells[0]*(y + cells[1]*z). Row i has the entry values[k][i] in the column of the cell at
/// offsets[k] from it, each offset once. Columns wrap along periodic axes, where on small grids several offsets may be
/// the same column: they add up. Beyond bounded axes entries are 0.
struct StencilMatrix {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  std::array<bool, 3> periodic{};
  std::vector<std::array<int, 3>> offsets;
  std::vector<std::vector<double>> values;

  std::int64_t size() const { return cells[0] * cells[1] * cells[2]; }
  bool operator==(const StencilMatrix&) const = default;
};

/// The cell at `offset` from cell (x, y, z); -1 beyond a bounded axis.
std::int64_t column_of(const StencilMatrix& matrix, std::array<std::int64_t, 3> cell, const std::array<int, 3>& offset);

StencilMatrix transposed(const StencilMatrix& matrix);

/// result = matrix*x
void multiply(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result);

/// `f`(row, column, value) on each entry that is not 0.
template <class F>
void for_each_entry(const StencilMatrix& matrix, const F& f) {
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    std::size_t row = 0;
    for (std::int64_t z = 0; z < matrix.cells[2]; ++z) {
      for (std::int64_t y = 0; y < matrix.cells[1]; ++y) {
        for (std::int64_t x = 0; x < matrix.cells[0]; ++x, ++row) {
          const double value = matrix.values[k][row];
          if (value == 0) continue;
          const std::int64_t column = column_of(matrix, {x, y, z}, matrix.offsets[k]);
          if (column >= 0) f(row, static_cast<std::size_t>(column), value);
        }
      }
    }
  }
}

}  // namespace dpde
