// SPDX-License-Identifier: Apache-2.0
// Moves fills. Before: fills are where the program has them. After: fills of inputs are in `prepare` (those of states
// also where the next state is written), and fills of fields that a sweep has just written are in its `then`.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::loop {

/// One operation and its effects on fields; a fill changes the halo only and modifies nothing.
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
  /// Fields whose boundary values change from step to step, or that other programs fill differently: their fills are
  /// not moved.
  std::set<std::string> filled_each_run;
};

struct Schedule {
  std::vector<Fill> prepare;
  std::vector<Operation> body;
};

Schedule schedule(ScheduleInput input);

}  // namespace dpde::loop
