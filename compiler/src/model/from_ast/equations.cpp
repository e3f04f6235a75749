// SPDX-License-Identifier: Apache-2.0
// Lets in their order, then the equations: one for each field.
#include <fmt/format.h>

#include <algorithm>

#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

void bind_let(Draft& draft, const ast::LetItem& item) {
  Typed value = Expressions(draft, Purpose::equation, "let " + item.name.name).definition(item.value);
  if (!declare(draft, item.name, Role::let)) return;
  if (value.type != Typed::Type::none) draft.lets.emplace(item.name.name, std::move(value));
}

State& state_called(Draft& draft, const std::string& name) {
  return *std::find_if(draft.problem.states.begin(), draft.problem.states.end(),
                       [&](const State& state) { return state.name == name; });
}

}  // namespace

void bind_equations(Draft& draft) {
  for (const auto& [item, range] : items_of<ast::LetItem>(draft.model->items)) bind_let(draft, item);
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::EquationItem>(draft.model->items)) {
    const std::string& name = item.field.name;
    if (!find_state(draft, item.field, "an equation")) continue;
    const auto [first, is_new] = seen.emplace(name, item.field.range);
    if (!is_new) {
      report_duplicate(draft, "the equation of " + name, item.field.range, first->second);
      continue;
    }
    State& state = state_called(draft, name);
    state.rhs = Expressions(draft, Purpose::equation, fmt::format("dt({})", name)).number(item.rhs);
    state.origin = {range};
  }
  for (const State& state : draft.problem.states) {
    if (seen.contains(state.name)) continue;
    draft.sink.report("missing-equation", draft.scope.find(state.name)->declared, {state.name},
                      fmt::format("write dt({0}) = ..., or coefficient {0} for what does not change", state.name));
  }
}

}  // namespace dpde::model
