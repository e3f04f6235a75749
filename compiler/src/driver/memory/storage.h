// SPDX-License-Identifier: Apache-2.0
// Predicts which states a gradient stores. The plan is the runtime's own (driver/memory/dry_engine.h).
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

/// nullopt if the step or a loss has no adjoint. @throws Error(input) if the budget is too small for any gradient.
std::optional<GradientPlan> plan_of_gradient(const Compiled& compiled, const StorageOptions& options);

}  // namespace dpde::driver
