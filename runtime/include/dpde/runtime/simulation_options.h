// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "dpde/runtime/clock.h"
#include "dpde/runtime/error.h"

namespace dpde {

/// Options of a scene compiled ahead of time; HostOptions has them for one compiled in memory.
struct SimulationOptions {
  std::vector<std::int64_t> cells;  // one number an axis, overrides the scene's
  int threads = 1;
  /// Memory limit for the stored states of gradient(); the others are recomputed (checkpoints). slots > 0 overrides it.
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();
  int slots = 0;
  /// > 0: gradient() leaves out effects across more than so many steps (RolloutSetup::cut); 1: across any step of the
  /// solver. It is then not the derivative of loss(). hessian_vector() ignores it.
  int cut = 0;
  /// Checked before each step: once true, step() and run() return false, loss() and gradient() NaN.
  const std::atomic<bool>* stop = nullptr;
  /// Not null: the time of loss() and gradient() is added to it, by category.
  GradientSeconds* seconds = nullptr;
  /// Adds the source location of the solve that an error comes from (Error::solve_for).
  std::function<void(Error&)> explain = nullptr;
};

}  // namespace dpde
