// SPDX-License-Identifier: Apache-2.0
// Memory layout of the values of a network: one plane for each channel, with a margin of cells around the grid. Rows
// begin on 64 bytes.
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
  int64_t plane = 0, origin = 0, size = 0;  // of a channel; of cell (0, 0, 0) of the first one; of all
  /// For each axis the source cells of cells -margin .. -1 and cells .. cells+margin-1; -1: none, they are 0.
  std::array<std::vector<int64_t>, 3> sources;

  int64_t rows() const { return cells[1] * cells[2]; }
  int64_t row(int64_t number) const { return number % cells[1] * stride[1] + number / cells[1] * stride[2]; }
  /// Number of elements from a row's first cell to the next row's margin.
  int64_t row_end() const { return stride[1] - margin[0]; }
};

/// The source of cell `cell`, any number, for a padding (DPDE_PAD_PERIODIC ...) of an axis of `cells`; -1: none.
int64_t padded(int32_t padding, int64_t cell, int64_t cells);

/// `line`: elements in 64 bytes. @throws Error(machine) for more bytes than addressable.
Shape make_shape(int64_t channels, const Axes& cells, const Axes& margin, const std::array<int32_t, 3>& padding,
                 int64_t line);

}  // namespace dpde::nn
