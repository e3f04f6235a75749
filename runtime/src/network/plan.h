// SPDX-License-Identifier: Apache-2.0
// What a network is on one grid: the sizes and places of its values and the sums of its convolutions. No memory of
// values.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dpde/network_abi.h"
#include "dpde/runtime/layout.h"
#include "network/kernels/kernels.h"
#include "network/shape.h"

namespace dpde::nn {

/// Sums over terms, as kernels want them. Weights lie [block][term][channel of the block].
struct Product {
  std::vector<int64_t> offsets;
  std::vector<Block> blocks;
  std::vector<int64_t> weights;  // for each packed weight its place among those of the network
};

/// A convolution of stride 1 reads its input with the margin it has; one of stride s reads phases: for each channel
/// s^rank planes, that of (fx, fy, fz) holding the cells s*p + f, margins included.
struct Convolution {
  bool phased = false;
  int64_t phase_count = 1;
  Axes reach{};  // cells of margin that are read
  Shape phases;  // when phased
  std::array<std::vector<std::vector<int64_t>>, 3>
      from;  // for axis, phase, place from -reach on: the cell of the input, -1: none
  Product forward;
  std::vector<Product> reverse;  // for each phase, from the adjoint of the result to that of what is read
};

struct Step {
  dpde_layer layer{};
  std::vector<int32_t> order;  // of the channels of DPDE_REORIENT; those of the layer may go away
  bool live = false;           // the output depends on it
  // A convolution whose result has one reader, a sum with a value that is there before, begins with that value
  // (`base`); where then one activation reads the result, that is done with it (`activation`, a step).
  int32_t base = -1, activation = -1;
  int32_t merged =
      -1;  // sum: the operand, such a convolution, whose rates and adjoints lie in the memory of the result's
  bool done =
      false;  // by the convolution before it, unless what derivatives need is to be kept; `done_kept`: even then
  bool done_kept = false;
  Convolution convolution;
};

struct Value {
  int64_t channels = 0, level = 1;
  Axes cells{1, 1, 1};
  int32_t readers = 0, reader = -1;  // live ones; the last
  Shape shape, adjoint;              // memory of values and rates, of adjoints
  int32_t root = 0;                  // the value whose memory its rates and adjoints lie in
  bool kept = true;                  // false: never stored by itself, since its reader is done with it
};

struct Plan {
  dpde_network network{};
  dpde_layout layout{};
  std::array<int32_t, 3> padding{};
  std::vector<Step> steps;
  std::vector<Value> values;  // 0: the input

  /// The derivative of its activation follows from its result.
  static bool result_tells(const dpde_layer& layer);
};

/// @throws Error(input) naming the network when it is broken or does not fit the grid.
Plan make_plan(const dpde_network& network, const dpde_layout& layout, int64_t widest_block);

}  // namespace dpde::nn
