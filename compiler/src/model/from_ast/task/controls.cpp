// SPDX-License-Identifier: Apache-2.0
// Controls: parameters with one value per time interval, from a formula of t evaluated in the middle of each interval.
#include <fmt/format.h>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr int most_values = 10000000;

/// One value per interval; empty after a diagnostic.
std::vector<double> values_of(Elaboration& elaboration, const Control& control, const Expr& formula,
                              SourceRange range) {
  const Problem& problem = elaboration.problem;
  std::vector<double> values;
  const int count = problem.steps > 0 ? (problem.steps - 1) / control.every + 1 : 0;
  if (count > most_values) {
    elaboration.sink.report("too-many-values", range,
                            {control.name, std::to_string(count), std::to_string(most_values)},
                            fmt::format("write {} = ... every {}", control.name, problem.step * 1000));
    return {};
  }
  for (int number = 0; number < count; ++number) {
    // the middle of a whole interval, also for the last one, which may be shorter
    const double t = problem.t_begin + (number + 0.5) * control.every * problem.step;
    const std::optional<double> value = made_once(elaboration, formula, range, t);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

const ast::ValueItem* line_of(const Elaboration& elaboration, const std::string& name) {
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
    if (item.name.name == name) return &item;
  }
  return nullptr;
}

const ast::UnknownItem* unknown_of(const Elaboration& elaboration, const std::string& name) {
  if (!elaboration.blocks.task) return nullptr;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
    if (!item.initial && item.name.name == name) return &item;
  }
  return nullptr;
}

/// The resolved formula and its values; empty values after a diagnostic.
void bind_formula(Elaboration& elaboration, const Control& control, const ast::Expr& written, Expr& formula,
                  std::vector<double>& values) {
  const auto read = formulas::number({elaboration, FormulaContext::control, control.name}, written);
  if (!read) return;
  formula = *read;
  values = values_of(elaboration, control, formula, written.range());
}

void bind_control(Elaboration& elaboration, Parameter& parameter) {
  Control control;
  control.name = parameter.name;
  const ast::ValueItem* line = line_of(elaboration, parameter.name);
  const ast::UnknownItem* unknown = unknown_of(elaboration, parameter.name);
  if (line && line->every) control.every = interval_of(elaboration, *line->every, "a control").value_or(1);
  if (unknown && unknown->from)
    bind_formula(elaboration, control, *unknown->from, control.start_formula, control.start);
  const auto set = elaboration.params.values.find(parameter.name);
  if (set != elaboration.params.values.end()) {
    control.formula = set->second.value_or(0);
    control.values = values_of(elaboration, control, control.formula, {});
  } else if (line) {
    control.origin = {line->name.range};
    bind_formula(elaboration, control, line->value, control.formula, control.values);
  } else if (unknown && unknown->from) {
    control.values = control.start;
    control.formula = control.start_formula;
  } else {
    elaboration.sink
        .report("missing-value", elaboration.blocks.scene->name.range, {"control", parameter.name},
                fmt::format("write {} = sin(t) in scene {}", parameter.name, elaboration.problem.scene))
        .notes.push_back({elaboration.names.scope.find(parameter.name)->declared, "it is declared here"});
  }
  if (unknown && !unknown->from) {
    control.start = control.values;
    control.start_formula = control.formula;
  }
  parameter.value = control.values.empty() ? 0 : control.values.front();
  elaboration.problem.controls.push_back(std::move(control));
}

}  // namespace

void bind_controls(Elaboration& elaboration) {
  for (Parameter& parameter : elaboration.problem.params) {
    if (elaboration.params.controls.contains(parameter.name)) bind_control(elaboration, parameter);
  }
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
    const Symbol* meaning = elaboration.names.scope.find(item.name.name);
    const bool is_field = meaning && meaning->role == Role::coefficient;  // checked by bind_coefficients
    if (!item.every || is_field || elaboration.params.controls.contains(item.name.name)) continue;
    elaboration.sink.report("not-allowed-here", item.every->range(), {"an interval", "the value of " + item.name.name},
                            fmt::format("declare it in the model: control {}", item.name.name));
  }
}

void bind_controls_of_windows(Elaboration& elaboration) {
  for (Control& control : elaboration.problem.controls) {
    control.values = values_of(elaboration, control, control.formula, control.origin.range);
    if (!control.start.empty())
      control.start = values_of(elaboration, control, control.start_formula, control.origin.range);
  }
}

}  // namespace dpde::model
