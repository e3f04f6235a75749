// SPDX-License-Identifier: Apache-2.0
// States as steps have them. What a scene begins with may contradict its masks, its constraints and what is done at the
// end of each step: a first stage sees that, and no other ever does. Verdicts are of what the others see.
#pragma once

#include <vector>

#include "driver/session.h"

namespace dpde::stability {

/// While it lives a run of the session begins as a step of no length leaves its initial states: those that are held
/// inside masks have the value there, those of a constraint fulfil it, events of each step have happened. What is not
/// finite so stays as it was.
class ConsistentStart {
 public:
  explicit ConsistentStart(driver::Session& session);
  ~ConsistentStart();
  ConsistentStart(const ConsistentStart&) = delete;
  ConsistentStart& operator=(const ConsistentStart&) = delete;

 private:
  struct Given {
    int state;
    std::vector<double> values;
  };
  driver::Session& session_;
  std::vector<Given> given_;
};

}  // namespace dpde::stability
