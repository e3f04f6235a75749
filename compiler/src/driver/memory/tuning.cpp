// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/tuning.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace dpde::driver {
namespace {

constexpr double least_field_bytes = 4 << 20;  // smallest field for which the runtime tunes sweeps

/// Largest cells times steps for which code is not optimised. Per term of a row, optimisation costs compilation time
/// and saves time in each cell and step. Measured break-even: 1e6 for heat with a sine, 3e6 for Burgers' equations
/// (tests/bench/README.md). Half of the smaller, since cached code costs no compilation.
constexpr double most_quick_cell_steps = 5e5;
constexpr double runs_of_a_certificate = 10;  // with gradients

/// The code key is part of it; the cache adds the processor.
std::string key_of(const Compiled& compiled, const RolloutSetup& setup) {
  return fmt::format("tuning\n{} cells, {} threads\n{}", fmt::join(setup.layout.cells, " "), setup.team.threads(),
                     compiled.cached.key);
}

codegen::CodeCache* cache_of(const Compiled& compiled) {
  return compiled.cached.key.empty() ? nullptr : compiled.options.cache.get();
}

}  // namespace

bool is_worth_tuning(const Compiled& compiled) {
  if (!compiled.problem) return false;
  double bytes = bytes_of(compiled.real());
  for (const model::Axis& axis : compiled.problem->axes) bytes *= axis.cells;
  return bytes >= least_field_bytes;
}

bool is_worth_optimising(const Compiled& compiled) {
  if (!compiled.problem) return true;
  const model::Problem& problem = *compiled.problem;
  if (problem.has_parts() || problem.steady > 0 || (problem.task && problem.task->training)) return true;
  double runs = compiled.options.runs;
  if (problem.task) runs = std::max(runs, runs_of_a_certificate);
  if (problem.task && problem.task->optimiser)
    runs = std::max(runs, runs_of_an_iteration * problem.task->optimiser->iterations);
  double cell_steps = problem.steps * runs;
  for (const model::Axis& axis : problem.axes) cell_steps *= axis.cells;
  return cell_steps > most_quick_cell_steps;
}

bool has_quick_code(const Compiled& compiled) {
  return compiled.options.backend == Backend::jit && !is_worth_optimising(compiled);
}

std::string find_tuning(const Compiled& compiled, const RolloutSetup& setup) {
  codegen::CodeCache* const cache = cache_of(compiled);
  return cache == nullptr ? "" : cache->find(key_of(compiled, setup)).value_or("");
}

void keep_tuning(const Compiled& compiled, const RolloutSetup& setup, const std::string& tuning) {
  codegen::CodeCache* const cache = cache_of(compiled);
  if (cache != nullptr && !tuning.empty()) cache->store(key_of(compiled, setup), tuning);
}

}  // namespace dpde::driver
