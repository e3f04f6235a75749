// SPDX-License-Identifier: Apache-2.0
// A network on one grid: sizes and offsets of its values and the sums of its convolutions. Holds no values.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dpde/network_abi.h"
#include "dpde/runtime/layout.h"
#include "network/kernels/kernels.h"
#include "network/shape.h"

namespace dpde::nn {

/// Sums over terms, as the kernels read them. Order of weights: [block][term][channel of the block].
struct Product {
  std::vector<int64_t> offsets;
  std::vector<Block> blocks;
  std::vector<int64_t> weights;  // for each packed weight its index in the network
};

/// A convolution of stride 1 reads its input with its margin. With stride s it reads phases: for each channel s^rank
/// planes, where that of (fx, fy, fz) holds the cells s*p + f, margins included.
struct Convolution {
  bool phased = false;
  int64_t phase_count = 1;
  Axes reach{};  // width of the margin that is read
  Shape phases;  // when phased
  std::array<std::vector<std::vector<int64_t>>, 3>
      from;  // for axis, phase, position from -reach on: the cell of the input, -1: none
  Product forward;
  std::vector<Product> reverse;  // for each phase, from the adjoint of the result to that of the input
};

struct Step {
  dpde_layer layer{};
  std::vector<int32_t> order;  // channel order of DPDE_REORIENT; a copy, since the layer's may not outlive it
  bool live = false;           // the output depends on it
  // If the only reader of a convolution's result adds it to an earlier value, the convolution starts its sums with that
  // value (`base`). If an activation is then the only reader, the convolution applies it too (`activation`, a step).
  int32_t base = -1, activation = -1;
  int32_t merged = -1;  // sum: its operand that is such a convolution and shares the memory of rates and adjoints
  bool done = false;    // done by the convolution, unless derivatives need its input; `done_kept`: even then
  bool done_kept = false;
  Convolution convolution;
};

struct Value {
  int64_t channels = 0, level = 1;
  Axes cells{1, 1, 1};
  int32_t readers = 0, reader = -1;  // number of live readers; the last one
  Shape shape, adjoint;              // memory of values and rates, of adjoints
  int32_t root = 0;                  // the value whose memory holds its rates and adjoints
  bool kept = true;                  // false: never stored, since the convolution continues with its reader
};

struct Plan {
  dpde_network network{};
  dpde_layout layout{};
  std::array<int32_t, 3> padding{};
  std::vector<Step> steps;
  std::vector<Value> values;  // 0: the input

  /// Whether the derivative of its activation can be computed from the result.
  static bool result_tells(const dpde_layer& layer);
};

/// @throws Error(input) with the network's name if it is invalid or does not fit the grid.
Plan make_plan(const dpde_network& network, const dpde_layout& layout, int64_t widest_block);

}  // namespace dpde::nn
