// SPDX-License-Identifier: Apache-2.0
// A step that is watched: on which sides of 0 values are where formulas are taken, in each stage, each part of a
// subcycle or a split step, and before events. States of its own carry that through all steps: `below` becomes 1 where
// a value is negative, `above` where it is positive. They hold signs and no values, so that what overflows, as a
// divisor may, is no state that has blown up.
//
// An event that is not one of each step takes its values at times that nothing moves. What these are between its times
// is of no account. It is taken for one that switches where it would if it happened at the beginning of its step.
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

  /// Looks at the values of events that are not those of each step: at first as these would find them if they happened
  /// at the beginning of the step, and then as they do. In other steps there are no marks of them.
  BeforeEvent before_events();
  /// With stages that look, behind those that take formulas. What a solve tries is not looked at, but what it finds.
  /// From the stage `end_of_step` on there are events alone.
  std::vector<Stage> behind(std::vector<Stage> stages, std::size_t end_of_step);
  /// Afterwards.
  std::vector<SidesMarked> marks() const;

 private:
  /// A field of a value that is carried along.
  struct Mark {
    std::string state, now;
    LoopCarried carry = {};  // of the block under way, where it is looked at
  };
  struct Value {
    WatchedValue watched;
    model::Placement placement;
    Mark below, above;
  };
  /// Which values are looked at behind a stage of a group, and what stands for the states.
  struct Look {
    std::size_t behind;
    Environment reading;
    std::vector<std::size_t> values;
  };
  using Group = std::vector<Stage>;  // stages of one block, or outside of blocks

  /// `end`: the first of its stages where the step ends.
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
  bool solves_ = false;           // for states, in blocks
  std::vector<Stage> supposed_;   // events at the beginning of the step; nobody reads what they make
  int looks_ = 0;
};

}  // namespace dpde::stencil
