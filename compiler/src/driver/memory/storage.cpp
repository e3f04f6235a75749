// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/storage.h"

#include <algorithm>
#include <cmath>

#include "driver/memory/cost.h"
#include "driver/memory/dry_engine.h"

namespace dpde::driver {

namespace {

constexpr std::int64_t least_budget = std::int64_t{1} << 26;

}  // namespace

std::int64_t budget_of_states(const StorageOptions& options) {
  if (!options.checkpoint_folder.empty()) return options.checkpoint_bytes;
  return std::min(options.checkpoint_bytes, std::max(available_memory() / 2, least_budget));
}

std::vector<int> steps_of(const model::When& when, const model::Problem& problem, int run_steps) {
  std::vector<int> steps;
  switch (when.kind) {
    case model::When::Kind::end: steps.push_back(run_steps); break;
    case model::When::Kind::at:
      for (const double t : when.times) {
        const double position = std::round((t - problem.t_begin) / problem.step);
        steps.push_back(static_cast<int>(std::clamp(position, 0.0, static_cast<double>(run_steps))));
      }
      std::sort(steps.begin(), steps.end());
      steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
      break;
    case model::When::Kind::over:
      for (int k = 0; k <= run_steps; ++k) steps.push_back(k);
      break;
    case model::When::Kind::steps:
      for (int k = when.is_last ? std::min(when.count, run_steps) : 1; k <= std::min(when.count, run_steps); ++k)
        steps.push_back(k);
      break;
  }
  return steps;
}

std::optional<GradientPlan> plan_of_gradient(const Compiled& compiled, const StorageOptions& options) {
  DryEngine engine(compiled, options);
  return engine.has_gradient() ? std::optional(plan_gradient(engine->objective_setup())) : std::nullopt;
}

}  // namespace dpde::driver
