// SPDX-License-Identifier: Apache-2.0
// Predicts which states a gradient stores. The plan is the runtime's own, made from the program tables without code.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

struct StorageOptions {
  int threads = 1;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();
  std::string checkpoint_folder;  // "": in memory
};

/// Bytes that stored states of a gradient may take. In memory at most half of what is available, so that states are
/// recomputed rather than memory exhausted.
std::int64_t budget_of_states(const StorageOptions& options);

/// Step numbers of the states at which a quantity is evaluated, in a run of `run_steps` steps.
std::vector<int> steps_of(const model::When& when, const model::Problem& problem, int run_steps);

/// Memory of the rollout of a run without a gradient.
GradientPlan plan_of_rollout(const Compiled& compiled);

/// The same for the run that precedes a gradient if its step marks watched values; empty if there is none.
GradientPlan plan_of_watched_run(const Compiled& compiled);

/// nullopt if the step or a loss has no adjoint. @throws Error(input) if the budget is too small for any gradient.
std::optional<GradientPlan> plan_of_gradient(const Compiled& compiled, const StorageOptions& options);

}  // namespace dpde::driver
