// SPDX-License-Identifier: Apache-2.0
// Cells of a grid by their indices along the axes.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace dpde {

using GridPlace = std::array<std::int64_t, 3>;

template <class F>
void for_each_cell(const std::array<std::int64_t, 3>& cells, const F& f) {
  std::size_t number = 0;
  for (std::int64_t z = 0; z < cells[2]; ++z) {
    for (std::int64_t y = 0; y < cells[1]; ++y) {
      for (std::int64_t x = 0; x < cells[0]; ++x) f(number++, GridPlace{x, y, z});
    }
  }
}

/// Cells along x that are multiplied in one go: they stay in the first-level cache between matrix entries.
inline constexpr std::int64_t cells_of_block = 256;

/// Calls `f`(index of the first cell, its indices along the axes, count) for blocks of cells along x.
template <class F>
void for_each_block(const std::array<std::int64_t, 3>& cells, const F& f) {
  std::size_t number = 0;
  for (std::int64_t z = 0; z < cells[2]; ++z) {
    for (std::int64_t y = 0; y < cells[1]; ++y) {
      for (std::int64_t x = 0; x < cells[0]; x += cells_of_block) {
        const std::int64_t count = std::min(cells_of_block, cells[0] - x);
        f(number, GridPlace{x, y, z}, count);
        number += static_cast<std::size_t>(count);
      }
    }
  }
}

/// The same for the rows `begin` to `end` along x, with row index y + cells[1]*z.
template <class F>
void for_each_block_of(const std::array<std::int64_t, 3>& cells, std::size_t begin, std::size_t end, const F& f) {
  const auto rows = static_cast<std::size_t>(cells[1]);
  for (std::size_t row = begin; row < end; ++row) {
    const GridPlace first{0, static_cast<std::int64_t>(row % rows), static_cast<std::int64_t>(row / rows)};
    for_each_block({cells[0], 1, 1}, [&](std::size_t number, const GridPlace& place, std::int64_t count) {
      f(row * static_cast<std::size_t>(cells[0]) + number, GridPlace{place[0], first[1], first[2]}, count);
    });
  }
}

inline std::size_t number_of(const std::array<std::int64_t, 3>& cells, const GridPlace& cell) {
  return static_cast<std::size_t>(cell[0] + cells[0] * (cell[1] + cells[1] * cell[2]));
}

/// Index of the neighbour at +-1 along an axis; -1 beyond a wall.
inline std::int64_t neighbour(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                              GridPlace cell, std::size_t axis, int step) {
  cell[axis] += step;
  if (periodic[axis]) cell[axis] = (cell[axis] + cells[axis]) % cells[axis];
  if (cell[axis] < 0 || cell[axis] >= cells[axis]) return -1;
  return static_cast<std::int64_t>(number_of(cells, cell));
}

}  // namespace dpde
