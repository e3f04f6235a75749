// SPDX-License-Identifier: Apache-2.0
// Initial states made consistent with the steps. A scene's initial state may contradict its masks, its constraints and
// its events of each step. Only the first stage of a run sees that state; verdicts are about the states of all others.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::stability {

/// Whether steps overwrite the state somewhere: by a mask, a constraint, or an event of each step.
bool is_set_by_steps(const model::Problem& problem, const std::string& state);

/// During its lifetime the session's initial states are those after a step of length 0: masked states have their
/// prescribed values, constraints are fulfilled, and events of each step have happened. Values that are then not finite
/// stay as they were. On large grids constraints are applied once, on a coarser grid (coarse_grid.h); masks and events
/// are applied on the scene's grid.
class ConsistentStart {
 public:
  explicit ConsistentStart(driver::Session& session);
  /// With a step at time t.
  ConsistentStart(driver::Session& session, double t);
  ~ConsistentStart();
  ConsistentStart(const ConsistentStart&) = delete;
  ConsistentStart& operator=(const ConsistentStart&) = delete;

 private:
  struct Given {
    int state;
    std::vector<double> values;
  };
  /// Applies the step to the states of `set`. True if one changed and another pass may change it further.
  bool take(const std::vector<std::pair<int, std::string>>& set, double t);

  driver::Session& session_;
  std::vector<Given> given_;
};

}  // namespace dpde::stability
