// SPDX-License-Identifier: Apache-2.0
// after step, every, at: values that change at the end of steps.
#include <fmt/format.h>

#include <cmath>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Numbers of the steps that end at these times; the initial state is not the end of a step.
std::vector<int> steps_at(Elaboration& elaboration, const std::vector<ast::Expr>& times) {
  const Problem& problem = elaboration.problem;
  std::vector<int> steps;
  for (const ast::Expr& time : times) {
    for (const double t : when_of(elaboration, ast::WhenAt{{time}}, true).times) {
      const int step = problem.step > 0 ? static_cast<int>(std::lround((t - problem.t_begin) / problem.step)) : 1;
      if (step >= 1) {
        steps.push_back(step);
      } else {
        elaboration.sink.report("not-allowed-here", time.range(), {"the begin of the run", "an event"},
                                "change the initial state");
      }
    }
  }
  return steps;
}

void bind_update(Elaboration& elaboration, const ast::EventItem::Update& update, Event& event,
                 std::map<std::string, SourceRange>& seen) {
  const std::vector<State*> states = find_states(
      elaboration, update.field, "an event",
      fmt::format("make {0} a field of the model, with dt({0}) = 0: an event sets it in all cells", update.field.name));
  if (states.empty() || !is_first(elaboration, "the new value", update.field, states, seen)) return;
  const auto values =
      formulas::components({elaboration, FormulaContext::event, update.field.name}, update.value, update.field.name);
  for (std::size_t i = 0; values && i < states.size(); ++i) {
    const Expr here = field(states[i]->name, {update.field.range});
    const Expr value =
        update.accumulate ? binary(BinaryOp::add, here, (*values)[i], {update.field.range}) : (*values)[i];
    event.updates.push_back({states[i]->name, with_points_as_numbers(elaboration.problem, value)});
  }
}

}  // namespace

void bind_events(Elaboration& elaboration) {
  for (const auto& [item, range] : items_of<ast::EventItem>(elaboration.blocks.scene->items)) {
    if (elaboration.blocks.program) {
      elaboration.sink.report("not-allowed-here", range, {"an event", "a scene of a program"},
                              "write the change in the program");
      continue;
    }
    Event event;
    event.origin = {range};
    if (item.every) event.every = interval_of(elaboration, *item.every, "an event").value_or(1);
    const bool is_plain = !item.every && item.times.empty();
    // A tolerance or a Courant number chooses substeps. An event after each substep would make states depend on this
    // choice.
    event.after_step = is_plain && !elaboration.problem.has_parts();
    if (is_plain && elaboration.problem.has_parts()) event.every = 1;
    event.at = steps_at(elaboration, item.times);
    std::map<std::string, SourceRange> seen;
    for (const ast::EventItem::Update& update : item.updates) bind_update(elaboration, update, event, seen);
    elaboration.problem.events.push_back(std::move(event));
  }
}

}  // namespace dpde::model
