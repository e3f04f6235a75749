// SPDX-License-Identifier: Apache-2.0
// Cells of a grid by their places along the axes.
#pragma once

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

inline std::size_t number_of(const std::array<std::int64_t, 3>& cells, const GridPlace& cell) {
  return static_cast<std::size_t>(cell[0] + cells[0] * (cell[1] + cells[1] * cell[2]));
}

/// Of the neighbour at +-1 along an axis; -1 beyond a wall.
inline std::int64_t neighbour(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                              GridPlace cell, std::size_t axis, int step) {
  cell[axis] += step;
  if (periodic[axis]) cell[axis] = (cell[axis] + cells[axis]) % cells[axis];
  if (cell[axis] < 0 || cell[axis] >= cells[axis]) return -1;
  return static_cast<std::int64_t>(number_of(cells, cell));
}

}  // namespace dpde
