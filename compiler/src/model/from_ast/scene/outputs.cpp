// SPDX-License-Identifier: Apache-2.0
// Output of a run.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "model/analyse/placement.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

std::optional<int> interval_of(Elaboration& elaboration, const ast::Expr& every, const char* what) {
  const auto interval = evaluate(elaboration, every, fmt::format("the interval of {}", what));
  const double step = elaboration.problem.step;
  if (!interval || step == 0) return std::nullopt;
  const auto steps = *interval > 0 ? whole_steps(*interval, step) : std::nullopt;
  if (steps && *steps >= 1 && *steps <= std::numeric_limits<int>::max()) return static_cast<int>(*steps);
  elaboration.sink.report(
      "output-off-step", every.range(), {what, fmt::format("{}", *interval), fmt::format("{}", step)},
      fmt::format("the nearest that is one is {}", std::max(1.0, std::round(*interval / step)) * step));
  return std::nullopt;
}

namespace {

/// Adds output fields for a let of the model that is not a field, for a named formula, or for the unknown of a solve: a
/// number, vector or tensor. Each component has its own placement (centres, if no field in it is on faces) or the
/// requested one. `written`: the name, or that of a component, slope.x.
std::vector<std::string> show(Elaboration& elaboration, const ast::Identifier& written, const std::string& name,
                              const TypedExpr& let, const std::optional<ast::Identifier>& on = {}) {
  std::vector<std::string> names;
  const std::size_t axes = elaboration.problem.axes.size();
  const Placements placements(elaboration.problem);
  for (std::size_t i = 0; i < let.parts.size(); ++i) {
    std::string component = name;
    if (let.type == TypedExpr::Type::vector) component += fmt::format(".{}", "xyz"[i]);
    if (let.type == TypedExpr::Type::tensor) component += fmt::format(".{}{}", "xyz"[i / axes], "xyz"[i % axes]);
    if (written.name != name && written.name != component) continue;
    const Expr value = over_one_cell(elaboration, let.parts[i]);
    const std::optional<Placement> own = placements.is_staggered() ? placements.natural(value) : std::nullopt;
    const int number = let.type == TypedExpr::Type::vector ? static_cast<int>(i) : -1;
    const Placement place = on ? placement_of(elaboration, on, number) : own.value_or(Placement{});
    if (!elaboration.problem.find_shown(component))
      elaboration.problem.shown.push_back({component, value, place, {written.range}});
    names.push_back(std::move(component));
  }
  return names;
}

/// A formula with its own name.
void bind_formula(Elaboration& elaboration, const ast::NamedFormula& formula,
                  std::map<std::string, SourceRange>& seen) {
  const ast::Identifier& name = formula.name;
  const TypedExpr value = formulas::numeric({elaboration, FormulaContext::quantity, name.name}, *formula.value);
  if (can_name_a_quantity(elaboration, name, seen) && value.type != TypedExpr::Type::none)
    show(elaboration, name, name.name, value, formula.on);
}

/// The states and other fields written under that name; empty after a diagnostic.
std::vector<std::string> written_down(Elaboration& elaboration, const ast::Identifier& name) {
  const std::string whole = name.name.substr(0, name.name.find('.'));
  const auto let = elaboration.names.lets.find(whole);
  std::vector<std::string> names;
  if (let != elaboration.names.lets.end() && let->second.type != TypedExpr::Type::condition)
    names = show(elaboration, name, whole, let->second);
  if (!names.empty()) return names;
  const Symbol* meaning = elaboration.names.scope.find(name.name);
  const bool has_failed = meaning != nullptr && meaning->role == Role::let && let == elaboration.names.lets.end() &&
                          !elaboration.names.scene_lets.contains(name.name);
  if (has_failed) return {};  // its definition has a diagnostic
  for (const State* state : find_states(elaboration, name, "an output")) names.push_back(state->name);
  return names;
}

}  // namespace

void bind_outputs(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::OutputItem>(elaboration.blocks.scene->items)) {
    Output output;
    output.origin = {range};
    for (const ast::Identifier& field : item.fields) {
      for (const std::string& name : written_down(elaboration, field)) {
        const auto [first, is_new] = seen.emplace(name, field.range);
        if (!is_new) report_duplicate(elaboration, "the output of " + name, field.range, first->second);
        if (is_new) output.fields.push_back(name);
      }
    }
    if (item.every) output.every = interval_of(elaboration, *item.every, "an output").value_or(0);
    elaboration.problem.outputs.push_back(std::move(output));
  }
}

void bind_shown(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const ast::NamedFormula& each : elaboration.selection.shown) {
    if (each.value) {
      bind_formula(elaboration, each, seen);
      continue;
    }
    const auto [first, is_new] = seen.emplace(each.name.name, each.name.range);
    if (!is_new) report_duplicate(elaboration, each.name.name, each.name.range, first->second);
    written_down(elaboration, each.name);
  }
}

}  // namespace dpde::model
