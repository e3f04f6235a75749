// SPDX-License-Identifier: Apache-2.0
#include "network/shape.h"

#include <algorithm>

#include "dpde/network_abi.h"
#include "dpde/runtime/error.h"

namespace dpde::nn {
namespace {

constexpr int64_t most_elements = int64_t{1} << 44;

int64_t times(int64_t a, int64_t b) {
  int64_t product = 0;
  if (__builtin_mul_overflow(a, b, &product) || product > most_elements) {
    throw Error(ErrorKind::machine, "the values of the network are larger than this machine can address");
  }
  return product;
}

int64_t modulo(int64_t a, int64_t n) { return (a % n + n) % n; }

}  // namespace

int64_t padded(int32_t padding, int64_t cell, int64_t cells) {
  switch (padding) {
    case DPDE_PAD_PERIODIC: return modulo(cell, cells);
    case DPDE_PAD_REPLICATE: return std::clamp<int64_t>(cell, 0, cells - 1);
    case DPDE_PAD_REFLECT: {
      const int64_t place = modulo(cell, 2 * cells);
      return place < cells ? place : 2 * cells - 1 - place;
    }
    default: return cell >= 0 && cell < cells ? cell : -1;
  }
}

Shape make_shape(int64_t channels, const Axes& cells, const Axes& margin, const std::array<int32_t, 3>& padding,
                 int64_t line) {
  Shape shape;
  shape.channels = channels;
  shape.cells = cells;
  shape.margin = margin;
  const auto round_up = [line](int64_t value) { return (value + line - 1) / line * line; };
  // Whole vectors may be written from cell 0 on, and from the first margin cell on over all cells and both margins.
  const int64_t row = round_up(std::max(round_up(cells[0]) + margin[0], cells[0] + 2 * margin[0]));
  const int64_t slab = times(row, cells[1] + 2 * margin[1]);
  // An odd number of cache lines: the same cell of many channels is then spread over the cache sets.
  const int64_t plane = (times(slab, cells[2] + 2 * margin[2]) / line | 1) * line;
  shape.stride = {1, row, slab};
  shape.plane = plane;
  shape.origin = round_up(margin[0]) + margin[1] * row + margin[2] * slab;
  shape.size = times(plane, channels) + 2 * row + 4 * line;
  for (size_t axis = 0; axis < 3; ++axis) {
    for (int64_t k = -margin[axis]; k < margin[axis]; ++k) {
      shape.sources[axis].push_back(padded(padding[axis], k < 0 ? k : cells[axis] + k, cells[axis]));
    }
  }
  return shape;
}

}  // namespace dpde::nn
