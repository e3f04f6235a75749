// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/watched_stages.h"

#include <algorithm>
#include <iterator>
#include <memory>

#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

bool is_solve(const Stage& stage) { return stage.block && stage.block->solve; }

/// All fields that the stages store. A scheme may name fields that it does not use; these are not included.
std::set<std::string> stored_by(const std::vector<Stage>& stages, const model::Problem& problem) {
  std::set<std::string> fields;
  for (const model::State& state : problem.states) fields.insert(state.name);
  for (const Stage& stage : stages) {
    for (const Store& store : stage.kernel.stores) fields.insert(store.field);
    for (const Prerequisite& preparation : stage.before) {
      match(preparation, ignored<Kernel, Reduce, NetworkCall, PreparedSolve>,
            [&](const Transform& transform) { fields.insert(transform.result); });  // schemes make states of waves
    }
    if (!stage.block) continue;
    for (const LoopCarried& carry : stage.block->carries) fields.insert(carry.result);
  }
  return fields;
}

/// Fields in which a stage stores the preceding solution, as replacements of states.
std::optional<Environment> solution_in(const Stage& stage, const Lowering& lowering) {
  if (!stage.reading) return std::nullopt;
  Environment reading = *stage.reading;
  for (const Store& store : stage.kernel.stores) {
    const std::string state = lowering.state_of(store.field);
    if (!state.empty() && is<Access>(store.value)) reading.fields[state] = store.field;
  }
  return reading;
}

}  // namespace

WatchedStages::WatchedStages(Lowering& lowering, std::string name, const std::vector<WatchedValue>& values)
    : lowering_(lowering), name_(std::move(name)) {
  const model::Placements placements(lowering.problem());
  for (const WatchedValue& watched : values) {
    const model::Placement placement = placements.natural(watched.value).value_or(model::Placement{});
    const std::string below = lowering.fresh_field_at(name_ + "_below", placement);
    const std::string above = lowering.fresh_field_at(name_ + "_above", placement);
    values_.push_back({watched, placement, {below, below}, {above, above}});
  }
}

/// Whether the stage evaluates formulas with the value: only if it computes a state in whose equation the value occurs.
/// At the end of the step no formula is evaluated, except on the solution of a solve.
bool WatchedStages::is_made_of(const Stage& stage, const Value& value, bool is_at_end) const {
  const std::set<std::string>& equations = value.watched.equations;
  if (equations.empty() && !value.watched.is_in_each_step) return true;
  const bool is_empty = stage.kernel.stores.empty();
  if (is_at_end) return value.watched.is_in_each_step || (is_empty && solves_);
  return !equations.empty() && (is_empty || std::ranges::any_of(stage.kernel.stores, [&](const Store& store) {
                                  const std::string state = lowering_.state_of(store.field);
                                  return state.empty() || equations.contains(state);
                                }));
}

/// Records each point of evaluation once. The first stage after a solve reads the solution.
std::vector<WatchedStages::Look> WatchedStages::looks_of(const Group& group, std::size_t end,
                                                         bool is_behind_solve) const {
  std::vector<Look> looks;
  bool is_at_end = false;
  const auto add = [&](std::size_t behind, Environment reading) {
    std::erase_if(reading.fields, [&](const auto& field) { return !stored_.contains(field.second); });
    Look look{behind, std::move(reading), {}};
    for (std::size_t v = 0; v < values_.size(); ++v) {
      const bool is_seen = std::ranges::any_of(looks, [&](const Look& other) {
        return other.reading.fields == look.reading.fields && other.reading.time == look.reading.time &&
               std::ranges::count(other.values, v) > 0;
      });
      const bool is_of_event = values_[v].watched.event.has_value();
      if (!is_seen && !is_of_event && is_made_of(group[behind], values_[v], is_at_end)) look.values.push_back(v);
    }
    if (!look.values.empty()) looks.push_back(std::move(look));
  };
  for (std::size_t i = 0; i < group.size(); ++i) {
    is_at_end = i >= end;
    if (group[i].reading) add(i, *group[i].reading);
    const std::optional<Environment> solution =
        is_behind_solve && i == 0 ? solution_in(group[i], lowering_) : std::optional<Environment>();
    if (solution) add(i, *solution);
  }
  return looks;
}

void WatchedStages::mark(Mark& mark, const Expr& is_there, bool is_last, const Value& value, Kernel& kernel) {
  const std::string to = is_last && !mark.carry.next.empty()
                             ? mark.carry.next
                             : lowering_.fresh_field_at(mark.state + "_now", value.placement);
  kernel.stores.push_back({to, false, select(is_there, 1.0, access(mark.now)), value.watched.value->origin});
  mark.now = to;
}

/// `left`: for each value, the number of recordings that remain in its group.
Stage WatchedStages::stage_of(const Look& look, std::vector<std::size_t>& left) {
  Kernel kernel = lowering_.kernel(name_ + "_" + std::to_string(++looks_));
  Discretiser at_point = lowering_.discretiser(look.reading);
  for (const std::size_t v : look.values) {
    Value& value = values_[v];
    const Expr now = at_point.shared("watched", at_point(value.watched.value, value.placement));
    const bool is_last = --left[v] == 0;
    mark(value.below, binary(BinaryOp::less, now, 0.0), is_last, value, kernel);
    mark(value.above, binary(BinaryOp::less, 0.0, now), is_last, value, kernel);
  }
  return Lowering::stage(std::move(kernel), at_point, look.reading.time);
}

BeforeEvent WatchedStages::before_events() {
  const BeforeEvent look = [this](std::size_t event, const Environment& reading) { return before(event, reading); };
  if (std::ranges::none_of(values_, [](const Value& value) { return value.watched.event.has_value(); })) return look;
  FieldsOfStates begins;
  for (const model::State& state : lowering_.problem().states) begins[state.name] = state.name;
  add_events(lowering_, supposed_, begins, look);
  return look;
}

std::optional<Stage> WatchedStages::before(std::size_t event, const Environment& reading) {
  Kernel kernel = lowering_.kernel(name_ + "_" + std::to_string(++looks_));
  Discretiser at_point = lowering_.discretiser(reading);
  const std::optional<Expr> happens = condition_of(lowering_.problem().events[event], lowering_.problem(), at_point);
  for (Value& value : values_) {
    if (value.watched.event != event) continue;
    const Expr now = at_point.shared("watched", at_point(value.watched.value, value.placement));
    for (Mark* mark : {&value.below, &value.above}) {
      const Expr is_there = mark == &value.below ? binary(BinaryOp::less, now, 0.0) : binary(BinaryOp::less, 0.0, now);
      const Expr marked = mark->now == mark->state ? Expr(0.0) : access(mark->now);
      const std::string to = lowering_.fresh_field_at(mark->state + "_now", value.placement);
      kernel.stores.push_back({to, false, select(binary(BinaryOp::logical_and, *happens, is_there), 1.0, marked),
                               value.watched.value->origin});
      mark->now = to;
    }
  }
  if (kernel.stores.empty()) return std::nullopt;
  return Lowering::stage(std::move(kernel), at_point, reading.time);
}

void WatchedStages::add_group(Group group, std::size_t end, bool is_behind_solve, std::vector<Stage>& result) {
  const std::vector<Look> looks = looks_of(group, end, is_behind_solve);
  std::vector<std::size_t> left(values_.size());
  for (const Look& look : looks) {
    for (const std::size_t v : look.values) ++left[v];
  }
  std::shared_ptr<StageBlock> block =
      group.front().block ? std::make_shared<StageBlock>(*group.front().block) : nullptr;
  const auto for_each_mark = [&](const auto& f) {
    for (Value& value : values_) {
      f(value, value.below);
      f(value, value.above);
    }
  };
  if (block) {
    for_each_mark([&](const Value& value, Mark& mark) {
      if (left[static_cast<std::size_t>(&value - values_.data())] == 0) return;
      mark.carry = {mark.now, lowering_.fresh_field_at(mark.state + "_next", value.placement),
                    lowering_.fresh_field_at(mark.state + "_now", value.placement)};
      block->carries.push_back(mark.carry);
    });
  }
  auto next = looks.begin();
  for (std::size_t i = 0; i < group.size(); ++i) {
    result.push_back(std::move(group[i]));
    result.back().block = block;
    for (; next != looks.end() && next->behind == i; ++next) {
      result.push_back(stage_of(*next, left));
      result.back().block = block;
    }
  }
  for_each_mark([](const Value&, Mark& mark) {
    if (!mark.carry.next.empty()) mark.now = mark.carry.result;
    mark.carry = {};
  });
}

std::vector<Stage> WatchedStages::behind(std::vector<Stage> stages, std::size_t end_of_step) {
  stored_ = stored_by(stages, lowering_.problem());
  solves_ = std::ranges::any_of(stages, is_solve);
  std::vector<Stage> result = supposed_;
  bool is_behind_solve = false;
  for (auto begin = stages.begin(); begin != stages.end();) {
    const auto end = std::find_if(begin, stages.end(), [&](const Stage& stage) { return stage.block != begin->block; });
    const bool solves = is_solve(*begin);
    const auto first = static_cast<std::size_t>(begin - stages.begin());
    Group group(std::make_move_iterator(begin), std::make_move_iterator(end));
    if (solves) std::ranges::move(group, std::back_inserter(result));
    if (!solves) add_group(std::move(group), end_of_step - std::min(first, end_of_step), is_behind_solve, result);
    is_behind_solve = solves;
    begin = end;
  }
  return result;
}

std::vector<SidesMarked> WatchedStages::marks() const {
  std::vector<SidesMarked> marks;
  for (const Value& value : values_) {
    SidesMarked& made = marks.emplace_back();
    if (value.below.now == value.below.state) continue;
    made = {value.below.state, value.above.state, {}};
    for (const Mark& mark : {value.below, value.above}) made.swaps.push_back({mark.state, mark.now});
  }
  return marks;
}

}  // namespace dpde::stencil
