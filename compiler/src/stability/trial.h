// SPDX-License-Identifier: Apache-2.0
// Runs that find out whether a step is stable: the compiled step itself, from the scene's initial state and from that
// with a small random disturbance in every cell, side by side.
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
  int steps = 0;           // of each run; 0: as many as its cells allow, 500 to 100000; with solves to 4000
  std::uint64_t seed = 0;  // of the disturbance
  double most_time = std::numeric_limits<double>::infinity();  // of each run: where steps change with it, the scene's
  double growth_rate = 0;       // that the equations have of their own, 1/time: twice that is allowed
  double growth_by_events = 0;  // ln a step
  StateGroup group = {};        // that are disturbed and looked at
  double largest_rate = 0;      // of all states: what the others grow to drowns differences in its rounding
  const std::atomic<bool>* stop = nullptr;
};

struct Trial {
  double step = 0;
  bool is_stable = false;
  double growth = 1;  // of the disturbance a step, over the second half of the run; infinite where it left all bounds
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
/// Between the largest step that is stable and the smallest that is not, to `precision` (relative). Tries begin about
/// `guess` and go up and down from there by no more than a factor of `range`. `tell` hears of every run.
Search search_limit(driver::Session& session, double guess, double precision, double range, const TrialOptions& options,
                    const std::function<void(const Trial&)>& tell = {});

}  // namespace dpde::stability
