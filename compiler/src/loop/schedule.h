// SPDX-License-Identifier: Apache-2.0
// Where fills happen. Before: fills stand where the program says. After: fills of inputs are in `prepare` (and those of
// states also where the next state is written), fills of fields a sweep has just written are in its `then`.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::loop {

/// One operation and what it does to fields; a fill changes the halo only and modifies nothing.
struct ScheduleItem {
  Operation operation;
  std::set<std::string> modified;
  std::set<std::string> touched;  // read or modified
};

struct ScheduleInput {
  std::vector<ScheduleItem> items;
  std::vector<std::string> inputs;
  std::vector<Swap> swaps;
  std::vector<Topology> axes;
  /// Fields whose boundary values change from step to step, or that other programs fill differently: their fills stay
  /// where they are.
  std::set<std::string> filled_each_run;
};

struct Schedule {
  std::vector<Fill> prepare;
  std::vector<Operation> body;
};

Schedule schedule(ScheduleInput input);

}  // namespace dpde::loop
