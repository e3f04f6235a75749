// SPDX-License-Identifier: Apache-2.0
// A step that records the signs of watched values wherever formulas are evaluated: in each stage, each substep of a
// subcycle or a split step, and before events. Additional states carry the record through all steps: `below` becomes 1
// where a value is negative, `above` where it is positive. They hold signs and not values, so that a value that
// overflows, as a divisor may, is not reported as a state that has blown up.
//
// An event that is not one of each step evaluates its values at fixed times; their values at other times do not matter.
// Such an event counts as a switch if it would switch at the start of its step.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "stencil/lower/events.h"
#include "stencil/lower/from_model.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

class WatchedStages {
 public:
  WatchedStages(Lowering& lowering, std::string name, const std::vector<WatchedValue>& values);

  /// Records the values of events that do not happen in each step: first their values at the start of the event's step,
  /// then those at the event. In other steps these values have no marks.
  BeforeEvent before_events();
  /// Adds recording stages after the stages that evaluate formulas. The solution of a solve is recorded, its trial
  /// values are not. From the stage `end_of_step` on there are events only.
  std::vector<Stage> behind(std::vector<Stage> stages, std::size_t end_of_step);
  /// The recorded signs after the last step.
  std::vector<SidesMarked> marks() const;

 private:
  /// A state that records a sign of a value.
  struct Mark {
    std::string state, now;
    LoopCarried carry = {};  // of the current block, if it records the value
  };
  struct Value {
    WatchedValue watched;
    model::Placement placement;
    Mark below, above;
  };
  /// The values that are recorded after stage `behind` of a group, and the fields that replace the states.
  struct Look {
    std::size_t behind;
    Environment reading;
    std::vector<std::size_t> values;
  };
  using Group = std::vector<Stage>;  // stages of one block, or outside of blocks

  /// `end`: index of the group's first stage at the end of the step.
  void add_group(Group group, std::size_t end, bool is_behind_solve, std::vector<Stage>& result);
  std::vector<Look> looks_of(const Group& group, std::size_t end, bool is_behind_solve) const;
  bool is_made_of(const Stage& stage, const Value& value, bool is_at_end) const;
  std::optional<Stage> before(std::size_t event, const Environment& reading);
  Stage stage_of(const Look& look, std::vector<std::size_t>& left);
  void mark(Mark& mark, const Expr& is_there, bool is_last, const Value& value, Kernel& kernel);

  Lowering& lowering_;
  std::string name_;
  std::vector<Value> values_;
  std::set<std::string> stored_;  // by all stages
  bool solves_ = false;           // whether blocks solve for states
  std::vector<Stage> supposed_;   // events as if at the start of the step; their results are not used
  int looks_ = 0;
};

}  // namespace dpde::stencil
