// SPDX-License-Identifier: Apache-2.0
// Stability by trial: two runs of the compiled step, one from the scene's initial state, one from the same with a
// small random disturbance in every cell.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "driver/scene/session.h"
#include "stability/state_groups.h"

namespace dpde::stability {

struct TrialOptions {
  int steps = 0;           // of each run; 0: 500 to 100000 by the number of cells, with solves up to 4000
  std::uint64_t seed = 0;  // of the disturbance
  double most_time = std::numeric_limits<double>::infinity();  // of each run: the scene's if steps depend on time
  double growth_rate = 0;                                      // of the equations, 1/time: twice that is allowed
  double growth_by_events = 0;                                 // allowed ln of growth by events in a step
  StateGroup group = {};                                       // states that are disturbed and compared
  double largest_rate = 0;  // growth rate of all states: other states may grow until their rounding hides differences
  const std::atomic<bool>* stop = nullptr;
};

struct Trial {
  double step = 0;
  bool is_stable = false;
  double growth = 1;  // of the disturbance in a step, over the second half of the run; infinite: it overflowed
  int steps = 0;      // that were made
};

/// nullopt when stopped.
std::optional<Trial> try_step(driver::Session& session, double step, const TrialOptions& options);

struct Search {
  double largest = 0;            // stable step found; 0: none was
  double smallest_unstable = 0;  // 0: none was found
  std::vector<Trial> trials;     // by increasing step
  bool was_stopped = false;
};
/// Brackets the limit between a stable and an unstable step to the relative `precision`. Trials begin at `guess` and
/// go up or down from there by at most a factor of `range`. `tell` is called after each run.
Search search_limit(driver::Session& session, double guess, double precision, double range, const TrialOptions& options,
                    const std::function<void(const Trial&)>& tell = {});

}  // namespace dpde::stability
