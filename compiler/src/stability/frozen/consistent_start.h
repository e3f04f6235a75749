// SPDX-License-Identifier: Apache-2.0
// States as steps have them. What a scene begins with may contradict its masks, its constraints and what is done at the
// end of each step: a first stage sees that, and no other ever does. Verdicts are of what the others see.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::stability {

/// The states that steps set somewhere, whatever they were: that a mask holds, a constraint makes true, or an event of
/// each step.
bool is_set_by_steps(const model::Problem& problem, const std::string& state);

/// While it lives a run of the session begins as a step of no length leaves its initial states: those that are held
/// inside masks have the value there, those of a constraint fulfil it, events of each step have happened. What is not
/// finite so stays as it was. On large grids constraints correct means of cells, once: see coarse_grid.h. What masks
/// hold and events leave is of each of the scene's cells.
class ConsistentStart {
 public:
  explicit ConsistentStart(driver::Session& session);
  /// Of a step at time t.
  ConsistentStart(driver::Session& session, double t);
  ~ConsistentStart();
  ConsistentStart(const ConsistentStart&) = delete;
  ConsistentStart& operator=(const ConsistentStart&) = delete;

 private:
  struct Given {
    int state;
    std::vector<double> values;
  };
  /// Whether any of them is another one then, and the same again may change it further.
  bool take(const std::vector<std::pair<int, std::string>>& set, double t);

  driver::Session& session_;
  std::vector<Given> given_;
};

}  // namespace dpde::stability
