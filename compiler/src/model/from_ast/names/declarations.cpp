// SPDX-License-Identifier: Apache-2.0
// The names a model declares, in file order; components of vectors follow with the grid.
#include <algorithm>
#include <set>

#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Calls `add` with each correctly declared name of the model's items of one kind.
template <class Item, class Add>
void for_each_declared(const Elaboration& elaboration, const Item& item, Role role, const Add& add) {
  for (const ast::Identifier& name : item.names) {
    const Symbol* meaning = elaboration.names.scope.find(name.name);
    if (meaning && meaning->role == role && meaning->declared == name.range) add(name.name);
  }
}

/// The field, or whole vector, of an equation of second order; "" for other equations.
std::string moved_field(const ast::EquationItem& item) {
  const std::string field = rated_field(item.field.name), vector = vector_of(field);
  return vector.empty() ? field : vector;
}

/// The velocity u_t of each field with an equation dt(dt(u)) = ...
void declare_velocities(Elaboration& elaboration) {
  std::set<std::string> moved;
  for (const auto& [item, range] : items_of<ast::EquationItem>(elaboration.blocks.model->items)) {
    const std::string field = moved_field(item);
    const Symbol* meaning = elaboration.names.scope.find(field);
    if (!meaning || meaning->role != Role::state || !moved.insert(field).second) continue;
    declare(elaboration, {velocity_name(field), item.field.range}, Role::state, meaning->is_vector);
  }
}

void bind_velocities(Elaboration& elaboration) {
  for (const auto& [item, range] : items_of<ast::EquationItem>(elaboration.blocks.model->items)) {
    const std::string field = moved_field(item), name = velocity_name(field);
    const Symbol* meaning = elaboration.names.scope.find(name);
    if (field.empty() || !meaning || meaning->declared != item.field.range) continue;
    const std::vector<std::string> moved = components_of(elaboration, field),
                                   components = declare_components(elaboration, name);
    for (std::size_t i = 0; i < components.size(); ++i) {
      State velocity;
      velocity.name = components[i];
      velocity.velocity_of = moved[i];
      velocity.placement = elaboration.problem.find_state(moved[i])->placement;
      elaboration.problem.states.push_back(std::move(velocity));
    }
  }
}

}  // namespace

void declare_model(Elaboration& elaboration) {
  for (const ast::Item& item : elaboration.blocks.model->items) {
    if (const auto* fields = get_if<ast::FieldItem>(&item.kind)) {
      for (const ast::Identifier& name : fields->names) declare(elaboration, name, Role::state, fields->vector);
    }
    if (const auto* given = get_if<ast::CoefficientItem>(&item.kind)) {
      for (const ast::Identifier& name : given->names) declare(elaboration, name, Role::coefficient, given->vector);
    }
    if (const auto* params = get_if<ast::ParamItem>(&item.kind)) {
      for (const ast::Identifier& name : params->names) {
        if (declare(elaboration, name, Role::parameter)) elaboration.problem.params.push_back({name.name});
      }
    }
  }
  for (const auto& [item, range] : items_of<ast::ControlItem>(elaboration.blocks.model->items)) {
    for (const ast::Identifier& name : item.names) {
      if (!declare(elaboration, name, Role::parameter)) continue;
      elaboration.problem.params.push_back({name.name});
      elaboration.params.controls.insert(name.name);
    }
  }
  declare_velocities(elaboration);
  if (!items_of<ast::FieldItem>(elaboration.blocks.model->items).empty()) return;
  const bool has_solves = !items_of<ast::SolvedItem>(elaboration.blocks.model->items).empty();
  elaboration.sink.report("no-field", elaboration.blocks.model->name.range, {elaboration.blocks.model->name.name},
                          has_solves
                              ? "a run takes steps of some field: write field rest and dt(rest) = 0 beside the solve, "
                                "initial rest = 0, and one step of time"
                              : "write field u and dt(u) = ...");
}

void bind_fields(Elaboration& elaboration) {
  for (const ast::Item& item : elaboration.blocks.model->items) {
    if (const auto* fields = get_if<ast::FieldItem>(&item.kind)) {
      for_each_declared(elaboration, *fields, Role::state, [&](const std::string& name) {
        int number = fields->vector ? 0 : -1;
        for (const std::string& component : declare_components(elaboration, name)) {
          State state;
          state.name = component;
          state.placement = placement_of(elaboration, fields->on, number++);
          elaboration.problem.states.push_back(std::move(state));
        }
      });
    }
    if (const auto* given = get_if<ast::CoefficientItem>(&item.kind)) {
      for_each_declared(elaboration, *given, Role::coefficient, [&](const std::string& name) {
        int number = given->vector ? 0 : -1;
        for (const std::string& component : declare_components(elaboration, name)) {
          Coefficient& coefficient = elaboration.problem.coefficients.emplace_back();
          coefficient.name = component;
          coefficient.placement = placement_of(elaboration, given->on, number++);
          coefficient.is_mask = given->mask;
          if (given->control) coefficient.every = 1;  // one step, unless the scene gives another interval
        }
      });
    }
  }
  bind_velocities(elaboration);
}

}  // namespace dpde::model
