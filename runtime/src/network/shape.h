// SPDX-License-Identifier: Apache-2.0
// Where the values of a network lie in memory: a plane a channel, with a margin of cells around the grid. Rows begin on
// 64 bytes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace dpde::nn {

using Axes = std::array<int64_t, 3>;

struct Shape {
  int64_t channels = 0;
  Axes cells{1, 1, 1}, margin{};
  Axes stride{};                            // in elements; those of y and z are multiples of 64 bytes
  int64_t plane = 0, origin = 0, size = 0;  // of a channel, of cell (0, 0, 0) of the first one, of all
  /// For each axis the cells that cells -margin .. -1 and cells .. cells+margin-1 repeat; -1: none, they are 0.
  std::array<std::vector<int64_t>, 3> sources;

  int64_t rows() const { return cells[1] * cells[2]; }
  int64_t row(int64_t number) const { return number % cells[1] * stride[1] + number / cells[1] * stride[2]; }
  /// Cells of a row up to where the margin of the next one begins.
  int64_t row_end() const { return stride[1] - margin[0]; }
};

/// The cell that `cell`, any number, repeats with a padding (DPDE_PAD_PERIODIC ...) of an axis of `cells`; -1: none.
int64_t padded(int32_t padding, int64_t cell, int64_t cells);

/// `line`: elements in 64 bytes. @throws Error(machine) for more bytes than addressable.
Shape make_shape(int64_t channels, const Axes& cells, const Axes& margin, const std::array<int32_t, 3>& padding,
                 int64_t line);

}  // namespace dpde::nn
