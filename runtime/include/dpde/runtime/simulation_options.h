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

struct SimulationOptions {
  std::vector<std::int64_t> cells;  // one number an axis, in place of the scene's
  int threads = 1;
  /// For the stored states of gradient(); what does not fit is computed again (checkpoints). slots > 0 overrides it.
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();
  int slots = 0;
  /// > 0: gradient() leaves out what acts through more than so many steps (RolloutSetup::cut); 1: nothing acts through
  /// the solver's steps. It is then not the derivative of loss(). hessian_vector() knows nothing of it.
  int cut = 0;
  /// Looked at before each step: when it becomes true, step() and run() return false, loss() and gradient() NaN.
  const std::atomic<bool>* stop = nullptr;
  /// Not null: the time of loss() and gradient() is added to it, by what it is spent on.
  GradientSeconds* seconds = nullptr;
  /// Says where in a text the solve stands that an error comes from (Error::solve_for).
  std::function<void(Error&)> explain = nullptr;
};

}  // namespace dpde
