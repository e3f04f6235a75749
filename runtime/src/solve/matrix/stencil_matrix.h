// SPDX-License-Identifier: Apache-2.0
// A linear operator on the cells of a grid as a stencil that may differ from cell to cell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "solve/fourier/grid_place.h"

namespace dpde {

/// Cells are numbered x + cells[0]*(y + cells[1]*z). Row i has the entry values[k][i] in the column of the cell at
/// offset offsets[k]; offsets are distinct. Columns wrap along periodic axes; on small grids several offsets may then
/// be the same column and add up. Beyond bounded axes entries are 0.
struct StencilMatrix {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  std::array<bool, 3> periodic{};
  std::vector<std::array<int, 3>> offsets;
  std::vector<std::vector<double>> values;

  std::int64_t size() const { return cells[0] * cells[1] * cells[2]; }
  bool operator==(const StencilMatrix&) const = default;
};

/// Largest difference of entries in equal rows, relative to the row's size. Also for f32: entries are images of unit
/// vectors, whose products are exact, so that equal cells give equal numbers. 64 roundings of f32 would hide a k of 60
/// in lap(p) - k*p on 1024^2 cells.
constexpr double difference_of_same_rows = 64 * 0x1p-52;

/// The cell at `offset` from cell (x, y, z); -1 beyond a bounded axis.
std::int64_t column_of(const StencilMatrix& matrix, std::array<std::int64_t, 3> cell, const std::array<int, 3>& offset);

/// result = matrix*x
void multiply(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result);
void multiply_transposed(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result);
/// Applies the rows of `count` cells along x, from `first` on, to x.
void multiply_cells(const StencilMatrix& matrix, const GridPlace& first, std::int64_t count, std::span<const double> x,
                    double* result);

/// Whether two entries are equal up to `rounding`.
inline bool are_same(double a, double b, double rounding) {
  return std::abs(a - b) <= 8 * rounding * std::max(std::abs(a), std::abs(b));
}
/// Whether each entry equals its transpose. A larger difference is an antisymmetric part, such as advection, however
/// small: its entries are smaller than those of diffusion by the cell size, but its effect on the solution is not.
bool is_symmetric(const StencilMatrix& matrix, double rounding);

/// Wraps position i along a periodic axis; -1 beyond the ends of a bounded one.
inline std::int64_t place_along(const StencilMatrix& matrix, std::size_t axis, std::int64_t i) {
  const std::int64_t n = matrix.cells[axis];
  if (i >= 0 && i < n) return i;
  return matrix.periodic[axis] ? (i % n + n) % n : -1;
}

/// Calls `f`(row, column, value) for each nonzero entry.
template <class F>
void for_each_entry(const StencilMatrix& matrix, const F& f) {
  const std::int64_t length = matrix.cells[0];
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const std::array<int, 3>& offset = matrix.offsets[k];
    const double* values = matrix.values[k].data();
    std::size_t row = 0;
    for (std::int64_t z = 0; z < matrix.cells[2]; ++z) {
      const std::int64_t plane = place_along(matrix, 2, z + offset[2]);
      for (std::int64_t y = 0; y < matrix.cells[1]; ++y) {
        const std::int64_t line = place_along(matrix, 1, y + offset[1]);
        const std::int64_t begin = length * (line + matrix.cells[1] * plane);
        for (std::int64_t x = 0; x < length; ++x, ++row) {
          if (values[row] == 0 || line < 0 || plane < 0) continue;
          const std::int64_t column = place_along(matrix, 0, x + offset[0]);
          if (column >= 0) f(row, static_cast<std::size_t>(begin + column), values[row]);
        }
      }
    }
  }
}

}  // namespace dpde
