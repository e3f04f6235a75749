// SPDX-License-Identifier: Apache-2.0
// The names a model declares, in the order of its text.
#include "model/from_ast/parts.h"

namespace dpde::model {

void declare_model(Draft& draft) {
  const auto each = [&](const std::vector<ast::Identifier>& names, Role role, const auto& add) {
    for (const ast::Identifier& name : names) {
      if (declare(draft, name, role)) add(name.name);
    }
  };
  for (const ast::Item& item : draft.model->items) {
    if (const auto* fields = std::get_if<ast::FieldItem>(&item.kind)) {
      each(fields->names, Role::state, [&](const std::string& name) {
        State state;
        state.name = name;
        draft.problem.states.push_back(std::move(state));
      });
    }
    if (const auto* coefficients = std::get_if<ast::CoefficientItem>(&item.kind)) {
      each(coefficients->names, Role::coefficient, [&](const std::string& name) {
        draft.problem.coefficients.push_back({name, {}});
      });
    }
    if (const auto* params = std::get_if<ast::ParamItem>(&item.kind)) {
      each(params->names, Role::parameter, [&](const std::string& name) { draft.problem.params.push_back({name}); });
    }
  }
  if (!items_of<ast::FieldItem>(draft.model->items).empty()) return;
  draft.sink.report("no-field", draft.model->name.range, {draft.model->name.name}, "write field u and dt(u) = ...");
}

}  // namespace dpde::model
