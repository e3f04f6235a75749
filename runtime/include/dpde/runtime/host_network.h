// SPDX-License-Identifier: Apache-2.0
// A network that the program around the scene computes itself: with a library of its own, on an accelerator, from a
// table.
//
//   network closure(u, ux) { host weights 120 }       # in the model, in place of layers
//   sim.supply("closure", {value, vector_jacobian});
#pragma once

#include <functional>
#include <span>

namespace dpde {

/// All arrays are dense and of doubles: the interior cells of the grid, channel after channel, x fastest; channels as
/// the model declares them, a vector one an axis. The results are to be set as a whole. What is thrown goes through to
/// who runs the scene. The functions are called in the floating-point mode of programs: subnormal numbers are 0
/// (float_mode.h).
struct HostNetwork {
  using In = std::span<const double>;
  using Out = std::span<double>;
  std::function<void(In inputs, In weights, Out outputs)> value;
  /// The transposed Jacobian at inputs and weights, times `seeds` (as the outputs). Only gradients need it.
  std::function<void(In inputs, In weights, In seeds, Out input_bars, Out weight_bars)> vector_jacobian;
};

}  // namespace dpde
