// SPDX-License-Identifier: Apache-2.0
// until steady 1e-8: runs that end when the state changes more slowly than this per unit of time, and restrictions on
// their tasks. The gradient is that of the steady state, by the implicit function theorem. It does not depend on the
// path or the initial state, and requires all steps to be identical.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"
#include "support/assert.h"
#include "support/match.h"
#include "syntax/expand/calls.h"
#include "syntax/item_kinds.h"

namespace dpde::model {

namespace {

bool is_of_time(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const auto* param = as<Param>(part);
    return param && param->name == "t";
  });
}

/// Whether steps depend on it.
bool is_part_of_steps(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step:
    case UseTime::boundary: return true;
    case UseTime::result:
    case UseTime::field:
    case UseTime::geometry:
    case UseTime::never: return false;
  }
  unreachable("time of a use");
}

/// The first item that makes steps differ.
const Origin* change_in_time(const Problem& problem) {
  const Origin* found = nullptr;
  for_each_formula(problem, [&](const Use& use) {
    if (found == nullptr && is_part_of_steps(use.kind) && is_of_time(use.formula)) found = &use.origin;
  });
  const auto rare =
      std::ranges::find_if(problem.events, [](const Event& event) { return !event.after_step && event.every != 1; });
  return found == nullptr && rare != problem.events.end() ? &rare->origin : found;
}

using PlaceInText = std::optional<Origin>;

PlaceInText time_in(const ast::Expr& e) {
  PlaceInText found;
  ast::for_each_name(e, [&](const std::string& name) {
    if (name == "t") found = Origin{e.range()};
  });
  return found;
}

PlaceInText time_in(const Elaboration& elaboration, const ast::RunItem& run) {
  const auto* kernel = find_declaration<ast::Kernel>(elaboration.file, run.kernel.name);
  for (std::size_t i = 0; kernel != nullptr && i < kernel->parameters.size(); ++i) {
    if (kernel->parameters[i].name.name == "t") return Origin{kernel->parameters[i].name.range};
  }
  return std::nullopt;
}

/// The first result of `place_in` for these parts.
template <class Parts, class PlaceIn>
PlaceInText first_place(const Parts& parts, const PlaceIn& place_in) {
  for (const auto& part : parts) {
    if (const PlaceInText found = place_in(part)) return found;
  }
  return std::nullopt;
}

/// Where the lines of a program, or of a block in it, use the time: kernel calls, sides and multipliers.
PlaceInText time_in(const Elaboration& elaboration, const std::vector<ast::Item>& items) {
  return first_place(items, [&](const ast::Item& item) {
    return match(
        item.kind, [&](const ast::RunItem& run) { return time_in(elaboration, run); },
        [](const ast::FillItem& fill) {
          return first_place(fill.sides, [](const ast::BoundarySide& side) { return time_in(side.value); });
        },
        [](const ast::TransformItem& transform) {
          return first_place(transform.terms, [](const ast::TransformItem::Term& term) { return time_in(term.by); });
        },
        [&](const ast::RepeatItem& repeat) { return time_in(elaboration, repeat.items); },
        [&](const ast::SolveItem& solve) { return time_in(elaboration, solve.items); },
        [](const ast::OneOf<ast::ReduceItem, ast::SwapItem, ast::StackItem, ast::KeepItem, ast::AxesItem,
                            ast::ApplyItem> auto&) { return PlaceInText(); },
        [](const ast::OutsidePrograms auto&) { return PlaceInText(); });
  });
}

void refuse(Elaboration& elaboration, const Origin& origin, const std::string& what, const char* hint) {
  elaboration.sink.report("not-allowed-here", origin.range, {what, "a task of a scene that runs until steady"}, hint);
}

void check_task(Elaboration& elaboration, const Task& task) {
  const Problem& problem = elaboration.problem;
  if (task.training)
    return refuse(elaboration, problem.time_origin, "learning from trajectories", "leave until steady out");
  for (const Loss& loss : task.losses) {
    if (loss.when.kind != When::Kind::end)
      refuse(elaboration, loss.origin, "a loss at given times", "its loss is one of the steady state: name no time");
  }
  for (const Test& test : task.tests) {
    if (test.when.kind != When::Kind::end)
      refuse(elaboration, test.quantity.origin, "a test at given times",
             "its tests are of the steady state: name no time");
  }
  for (const Unknown& unknown : task.unknowns) {
    if (unknown.kind == Unknown::Kind::initial)
      refuse(elaboration, unknown.origin, "an unknown initial state",
             "the steady state does not depend on where the run begins; leave until steady out");
  }
  const Origin* change = change_in_time(problem);
  const PlaceInText in_program =
      elaboration.blocks.program ? time_in(elaboration, elaboration.blocks.program->items) : std::nullopt;
  if (change != nullptr || in_program)
    refuse(elaboration, change != nullptr ? *change : *in_program, "a step that depends on time",
           "the gradient is that of a state which each further step leaves as it is: leave t out, or until steady");
}

}  // namespace

void check_steady(Elaboration& elaboration) {
  const auto lines = items_of<ast::TimeItem>(elaboration.blocks.scene->items);
  if (lines.empty() || !lines.front().kind.steady) return;
  const ast::Expr& written = *lines.front().kind.steady;
  const auto tolerance = evaluate(elaboration, written, "the tolerance");
  if (!tolerance) return;
  if (!(*tolerance > 0))
    elaboration.sink.report("bad-step", written.range(), {"tolerance", fmt::format("{}", *tolerance)});
  const bool has_control_fields = std::ranges::any_of(elaboration.problem.coefficients, &Coefficient::is_control);
  if (!elaboration.problem.controls.empty() || has_control_fields)
    elaboration.sink.report("not-allowed-here", written.range(),
                            {"until steady", "a scene with controls, which vary in time"},
                            "make them parameters and coefficients");
  if (elaboration.problem.substeps.control)
    elaboration.sink.report("not-allowed-here", written.range(),
                            {"until steady", "a scene whose steps follow a tolerance, which are not all the same"},
                            "leave the tolerance out, or run for a given time");
  elaboration.problem.steady = *tolerance;
  if (elaboration.problem.task) check_task(elaboration, *elaboration.problem.task);
}

}  // namespace dpde::model
