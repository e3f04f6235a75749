// SPDX-License-Identifier: Apache-2.0
// Lets in their order, then the equations: one for each field.
#include <fmt/format.h>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

void bind_let(Draft& draft, const ast::LetItem& item) {
  Typed value = Expressions(draft, Purpose::equation, "let " + item.name.name).definition(item.value);
  if (!declare(draft, item.name, Role::let)) return;
  if (value.type != Typed::Type::none) draft.lets.emplace(item.name.name, std::move(value));
}

}  // namespace

void bind_equations(Draft& draft) {
  for (const auto& [item, range] : items_of<ast::LetItem>(draft.model->items)) bind_let(draft, item);
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::EquationItem>(draft.model->items)) {
    const std::string rated = rated_field(item.field.name);
    const ast::Identifier name{rated.empty() ? item.field.name : rated, item.field.range};
    const std::vector<State*> moved = find_states(draft, name, "an equation");
    const std::vector<State*> states =
        rated.empty() || moved.empty() ? moved : find_states(draft, item.field, "an equation");
    if (states.empty() || !is_first(draft, "the equation", name, moved, seen)) continue;
    const std::string subject = fmt::format("dt({})", item.field.name);
    const auto rhs = Expressions(draft, Purpose::equation, subject).components(item.rhs, item.field.name);
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (!rated.empty()) moved[i]->rhs = field(states[i]->name, {item.field.range});
      moved[i]->origin = states[i]->origin = {range};
      seen.emplace(states[i]->name, item.field.range);
      if (rhs) states[i]->rhs = (*rhs)[i];
    }
  }
  for (const std::string& name : states_not_in(draft, seen)) {
    draft.sink.report("missing-equation", draft.scope.find(name)->declared, {name},
                      fmt::format("write dt({0}) = ..., or coefficient {0} for what does not change", name));
  }
}

}  // namespace dpde::model
