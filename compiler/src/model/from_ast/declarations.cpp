// SPDX-License-Identifier: Apache-2.0
// The names a model declares, in the order of its text; a vector's components are known with the grid.
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Calls `add` with each name of the model's items of one kind that means what it should.
template <class Item, class Add>
void for_each_declared(const Draft& draft, const Item& item, Role role, const Add& add) {
  for (const ast::Identifier& name : item.names) {
    const Meaning* meaning = draft.scope.find(name.name);
    if (meaning && meaning->role == role && meaning->declared == name.range) add(name.name);
  }
}

}  // namespace

void declare_model(Draft& draft) {
  for (const ast::Item& item : draft.model->items) {
    if (const auto* fields = std::get_if<ast::FieldItem>(&item.kind)) {
      for (const ast::Identifier& name : fields->names) declare(draft, name, Role::state, fields->vector);
    }
    if (const auto* given = std::get_if<ast::CoefficientItem>(&item.kind)) {
      for (const ast::Identifier& name : given->names) declare(draft, name, Role::coefficient, given->vector);
    }
    if (const auto* params = std::get_if<ast::ParamItem>(&item.kind)) {
      for (const ast::Identifier& name : params->names) {
        if (declare(draft, name, Role::parameter)) draft.problem.params.push_back({name.name});
      }
    }
  }
  if (!items_of<ast::FieldItem>(draft.model->items).empty()) return;
  draft.sink.report("no-field", draft.model->name.range, {draft.model->name.name}, "write field u and dt(u) = ...");
}

void bind_fields(Draft& draft) {
  for (const ast::Item& item : draft.model->items) {
    if (const auto* fields = std::get_if<ast::FieldItem>(&item.kind)) {
      for_each_declared(draft, *fields, Role::state, [&](const std::string& name) {
        for (const std::string& component : declare_components(draft, name)) {
          State state;
          state.name = component;
          draft.problem.states.push_back(std::move(state));
        }
      });
    }
    if (const auto* given = std::get_if<ast::CoefficientItem>(&item.kind)) {
      for_each_declared(draft, *given, Role::coefficient, [&](const std::string& name) {
        for (const std::string& component : declare_components(draft, name)) {
          draft.problem.coefficients.push_back({component, {}});
        }
      });
    }
  }
}

}  // namespace dpde::model
