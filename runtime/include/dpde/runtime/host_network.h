// SPDX-License-Identifier: Apache-2.0
// A network that the host program computes itself: with its own library, on an accelerator, from a table.
//
//   network closure(u, ux) { host weights 120 }       # in the model, in place of layers
//   sim.supply("closure", {value, vector_jacobian});
#pragma once

#include <functional>
#include <span>

namespace dpde {

/// All arrays are dense doubles: the interior cells of the grid, channel after channel, x fastest; channels in the
/// order of the model's declaration, a vector has one for each axis. The functions must set their whole results.
/// Exceptions propagate to the caller that runs the scene. The functions run in the floating-point mode of programs:
/// subnormal numbers are 0 (float_mode.h).
struct HostNetwork {
  using In = std::span<const double>;
  using Out = std::span<double>;
  std::function<void(In inputs, In weights, Out outputs)> value;
  /// Transposed Jacobian at (inputs, weights) times `seeds`, which have the shape of the outputs. Only gradients need
  /// it.
  std::function<void(In inputs, In weights, In seeds, Out input_bars, Out weight_bars)> vector_jacobian;
};

}  // namespace dpde
