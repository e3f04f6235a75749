// SPDX-License-Identifier: Apache-2.0
// Controls: parameters with one value for each interval of time, from a formula of t taken in the middle of each.
#include <fmt/format.h>

#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr int most_values = 10000000;

/// One value an interval; empty after a diagnostic.
std::vector<double> values_of(Draft& draft, const Control& control, const Expr& formula, SourceRange range) {
  const Problem& problem = draft.problem;
  std::vector<double> values;
  const int count = problem.steps > 0 ? (problem.steps - 1) / control.every + 1 : 0;
  if (count > most_values) {
    draft.sink.report("too-many-values", range, {control.name, std::to_string(count), std::to_string(most_values)},
                      fmt::format("write {} = ... every {}", control.name, problem.step * 1000));
    return {};
  }
  for (int number = 0; number < count; ++number) {
    const double t =
        problem.t_begin + (number + 0.5) * control.every * problem.step;  // of a whole interval, the last one too
    const std::optional<double> value = made_once(draft, formula, range, t);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

const ast::ValueItem* line_of(const Draft& draft, const std::string& name) {
  for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items)) {
    if (item.name.name == name) return &item;
  }
  return nullptr;
}

const ast::UnknownItem* unknown_of(const Draft& draft, const std::string& name) {
  if (!draft.task) return nullptr;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(draft.task->items)) {
    if (!item.initial && item.name.name == name) return &item;
  }
  return nullptr;
}

/// The formula as written and its values, none after a diagnostic.
void bind_formula(Draft& draft, const Control& control, const ast::Expr& written, Expr& formula,
                  std::vector<double>& values) {
  const auto read = Expressions(draft, Purpose::control, control.name).number(written);
  if (!read) return;
  formula = *read;
  values = values_of(draft, control, formula, written.range());
}

void bind_control(Draft& draft, Parameter& parameter) {
  Control control;
  control.name = parameter.name;
  const ast::ValueItem* line = line_of(draft, parameter.name);
  const ast::UnknownItem* unknown = unknown_of(draft, parameter.name);
  if (line && line->every) control.every = interval_of(draft, *line->every, "a control").value_or(1);
  if (unknown && unknown->from) bind_formula(draft, control, *unknown->from, control.start_formula, control.start);
  const auto set = draft.values.find(parameter.name);
  if (set != draft.values.end()) {
    control.formula = set->second.value_or(0);
    control.values = values_of(draft, control, control.formula, {});
  } else if (line) {
    control.origin = {line->name.range};
    bind_formula(draft, control, line->value, control.formula, control.values);
  } else if (unknown && unknown->from) {
    control.values = control.start;
    control.formula = control.start_formula;
  } else {
    draft.sink
        .report("missing-value", draft.scene->name.range, {"control", parameter.name},
                fmt::format("write {} = sin(t) in scene {}", parameter.name, draft.problem.scene))
        .notes.push_back({draft.scope.find(parameter.name)->declared, "it is declared here"});
  }
  if (unknown && !unknown->from) {
    control.start = control.values;
    control.start_formula = control.formula;
  }
  parameter.value = control.values.empty() ? 0 : control.values.front();
  draft.problem.controls.push_back(std::move(control));
}

}  // namespace

void bind_controls(Draft& draft) {
  for (Parameter& parameter : draft.problem.params) {
    if (draft.controls.contains(parameter.name)) bind_control(draft, parameter);
  }
  for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items)) {
    const Meaning* meaning = draft.scope.find(item.name.name);
    const bool is_field = meaning && meaning->role == Role::coefficient;  // bind_coefficients looks at those
    if (!item.every || is_field || draft.controls.contains(item.name.name)) continue;
    draft.sink.report("not-allowed-here", item.every->range(), {"an interval", "the value of " + item.name.name},
                      fmt::format("declare it in the model: control {}", item.name.name));
  }
}

void bind_controls_of_windows(Draft& draft) {
  for (Control& control : draft.problem.controls) {
    control.values = values_of(draft, control, control.formula, control.origin.range);
    if (!control.start.empty()) control.start = values_of(draft, control, control.start_formula, control.origin.range);
  }
}

}  // namespace dpde::model
