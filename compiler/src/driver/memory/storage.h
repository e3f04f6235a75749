// SPDX-License-Identifier: Apache-2.0
// Which states a gradient stores, before it runs: the plan is the runtime's own, made of the programs without their
// code.
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

/// Bytes that the states of a gradient may take on this machine: in memory no more than half of what is left, so that
/// it makes states again rather than fail.
std::int64_t budget_of_states(const StorageOptions& options);

/// The states at which a quantity counts, as step numbers of a run of so many steps.
std::vector<int> steps_of(const model::When& when, const model::Problem& problem, int run_steps);

/// Of a run without a gradient: what its rollout holds.
GradientPlan plan_of_rollout(const Compiled& compiled);

/// The same of the run that a gradient makes first of a step that marks what is watched; empty where there is none.
GradientPlan plan_of_watched_run(const Compiled& compiled);

/// nullopt where the step or a loss has no adjoint. @throws Error(input) where the budget is too small for any
/// gradient.
std::optional<GradientPlan> plan_of_gradient(const Compiled& compiled, const StorageOptions& options);

}  // namespace dpde::driver
