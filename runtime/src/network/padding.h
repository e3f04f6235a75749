// SPDX-License-Identifier: Apache-2.0
// Margins of one plane: filling them, and the transpose.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "dpde/network_abi.h"
#include "network/shape.h"

namespace dpde::nn {

/// Cell `k` of a margin of `margin` cells on either side: -margin .. -1, then cells .. cells+margin-1.
inline int64_t margin_cell(int64_t k, int64_t margin, int64_t cells) {
  return k < margin ? k - margin : cells + k - margin;
}

/// Fills the margins from the cells by shape.sources; padding between margins becomes 0.
template <class Real>
void fill_margin(const Shape& shape, Real* plane) {
  const auto [nx, ny, nz] = shape.cells;
  const int64_t mx = shape.margin[0], my = shape.margin[1], mz = shape.margin[2];
  for (int64_t z = 0; z < nz; ++z) {
    for (int64_t y = 0; y < ny; ++y) {
      Real* const row = plane + y * shape.stride[1] + z * shape.stride[2];
      for (int64_t k = 0; k < 2 * mx; ++k) {
        const int64_t source = shape.sources[0][static_cast<size_t>(k)];
        row[margin_cell(k, mx, nx)] = source < 0 ? Real(0) : row[source];
      }
      std::fill(row + nx + mx, row + shape.row_end(), Real(0));
    }
  }
  const auto copy_row = [&](int64_t y, int64_t z, int64_t from_y, int64_t from_z, bool zero) {
    Real* const row = plane + y * shape.stride[1] + z * shape.stride[2] - mx;
    const Real* const from = plane + from_y * shape.stride[1] + from_z * shape.stride[2] - mx;
    if (zero) return void(std::fill(row, row + shape.stride[1], Real(0)));
    std::copy(from, from + shape.stride[1], row);
  };
  for (int64_t z = 0; z < nz; ++z) {
    for (int64_t k = 0; k < 2 * my; ++k) {
      const int64_t source = shape.sources[1][static_cast<size_t>(k)];
      copy_row(margin_cell(k, my, ny), z, source, z, source < 0);
    }
  }
  for (int64_t k = 0; k < 2 * mz; ++k) {
    const int64_t source = shape.sources[2][static_cast<size_t>(k)];
    for (int64_t y = -my; y < ny + my; ++y) copy_row(y, margin_cell(k, mz, nz), y, source, source < 0);
  }
}

/// Sets everything except the cells to 0.
template <class Real>
void clear_margin(const Shape& shape, Real* plane) {
  const int64_t mx = shape.margin[0];
  for (int64_t z = -shape.margin[2]; z < shape.cells[2] + shape.margin[2]; ++z) {
    for (int64_t y = -shape.margin[1]; y < shape.cells[1] + shape.margin[1]; ++y) {
      Real* const row = plane + y * shape.stride[1] + z * shape.stride[2];
      const bool inside = y >= 0 && y < shape.cells[1] && z >= 0 && z < shape.cells[2];
      std::fill(row - mx, inside ? row : row + shape.row_end(), Real(0));
      if (inside) std::fill(row + shape.cells[0], row + shape.row_end(), Real(0));
    }
  }
}

/// True for paddings whose transpose adds margins to cells.
inline bool folds(int32_t padding) { return padding == DPDE_PAD_REPLICATE || padding == DPDE_PAD_REFLECT; }

/// The transpose of filling `reach` cells of the margins along axes that fold.
template <class Real>
void fold_margin(const Shape& shape, const std::array<int32_t, 3>& padding, const Axes& reach, Real* plane) {
  Axes extra{};
  for (size_t axis = 0; axis < 3; ++axis) extra[axis] = folds(padding[axis]) ? reach[axis] : 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t own = extra[axis];
    extra[axis] = 0;
    for (int64_t k = 0; k < 2 * own; ++k) {
      const int64_t from = margin_cell(k, own, shape.cells[axis]), to = padded(padding[axis], from, shape.cells[axis]);
      Axes low{-extra[0], -extra[1], -extra[2]}, high{};
      for (size_t other = 0; other < 3; ++other) high[other] = shape.cells[other] + extra[other];
      low[axis] = from;
      high[axis] = from + 1;
      const int64_t shift = (to - from) * shape.stride[axis];
      for (int64_t z = low[2]; z < high[2]; ++z) {
        for (int64_t y = low[1]; y < high[1]; ++y) {
          Real* const row = plane + y * shape.stride[1] + z * shape.stride[2];
          for (int64_t x = low[0]; x < high[0]; ++x) row[x + shift] += row[x];
        }
      }
    }
  }
}

}  // namespace dpde::nn
