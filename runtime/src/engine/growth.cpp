// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "dpde/runtime/communicator.h"

namespace dpde {

namespace {

/// Largest magnitudes of the states one step after the end of a run; infinite if no longer finite.
std::vector<double> one_step_further(Engine& engine, const std::vector<void*>& end, double t) {
  RolloutSetup setup = engine.setup();
  setup.steps = 1;
  setup.t0 = t;
  Rollout further(std::move(setup));
  engine.begin_other(further);
  const dpde_layout& layout = engine.workspace().layout();
  std::vector<double> values(engine.workspace().cell_count());
  for (int s = 0; s < further.state_count(); ++s) {
    copy_out(layout, end[static_cast<std::size_t>(s)], values);
    further.initial(s).copy_in(values);
  }
  const bool ends = further.run().blow_up.has_value();
  std::vector<double> result;
  for (const void* const last : further.final_states()) {
    const double largest = largest_of(engine.options().ranks, largest_magnitude(layout, last));
    result.push_back(ends ? std::numeric_limits<double>::infinity() : largest);
  }
  return result;
}

}  // namespace

double largest_magnitude(const dpde_layout& layout, const void* base) {
  double largest = 0;
  const auto look = [&](const auto* values) {
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        const auto* row = values + index_of(layout, 0, y, z);
        for (std::int64_t x = 0; x < layout.cells[0]; ++x)
          largest = std::max(largest, std::abs(static_cast<double>(row[x])));
      }
    }
  };
  layout.real == DPDE_F32 ? look(static_cast<const float*>(base)) : look(static_cast<const double*>(base));
  return largest;
}

std::vector<Growth> growths_of(Engine& engine, const std::vector<double>& before, const std::vector<void*>& end,
                               int steps, double t, double suspicious) {
  std::vector<Growth> result;
  std::vector<double> further;
  Communicator* const ranks = engine.options().ranks;  // global values: all ranks make the extra step, or none
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    const Growth growth{engine.states()[s].name, largest_of(ranks, before[s]),
                        largest_of(ranks, largest_magnitude(engine.workspace().layout(), end[s]))};
    if (growth.before == 0 || growth.after <= suspicious * growth.before) continue;
    if (growth.is_beyond_reason()) {
      result.push_back(growth);
      continue;
    }
    if (further.empty()) further = one_step_further(engine, end, t);
    // An instability grows by the same factor in each step. A field that began near 0 and is driven by others does not.
    const double again = std::log(further[s] / growth.after) * steps;
    if (again >= 0.5 * std::log(growth.after / growth.before)) result.push_back(growth);
  }
  return result;
}

}  // namespace dpde
