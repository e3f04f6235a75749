// SPDX-License-Identifier: Apache-2.0
// Names of a scene that stand for formulas: let k = 2*pi/L; initial h = 1 - b, where b is an initial state or a
// coefficient given by a formula. The formula is substituted for the name.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr std::size_t max_names_of_names = 200;  // limited by the stack

bool stands_in_model(const Elaboration& elaboration, SourceRange range) {
  return elaboration.blocks.model && std::ranges::any_of(elaboration.blocks.model->items, [&](const ast::Item& item) {
           return item.range.begin <= range.begin && range.end <= item.range.end;
         });
}

/// The scene's value for the state or coefficient, as a whole or for this component.
struct Giver {
  const ast::Expr* value = nullptr;
  bool is_projected = false;
};
Giver giver_of(const Elaboration& elaboration, const std::string& name, Role role) {
  const std::string whole = vector_of(name);
  const auto gives = [&](const std::string& given) { return given == name || (!whole.empty() && given == whole); };
  if (role == Role::coefficient) {
    for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
      if (gives(item.name.name)) return {&item.value};
    }
    return {};
  }
  for (const auto& [item, range] : items_of<ast::InitialItem>(elaboration.blocks.scene->items)) {
    if (gives(item.field.name)) return {&item.value, item.projected.has_value()};
  }
  return {};
}

/// Why the formula cannot replace the name: the field would differ from it.
std::string obstacle(const Elaboration& elaboration, const std::string& name, Role role, const Giver& giver) {
  const std::string whole = vector_of(name);
  if (elaboration.blocks.task) {
    for (const auto& [unknown, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
      const std::string& sought = unknown.name.name;
      const bool is_it = sought == name || sought == whole || vector_of(sought) == name;
      if (is_it && unknown.initial == (role == Role::state)) return "it is an unknown of the task";
    }
  }
  const Coefficient* coefficient = elaboration.problem.find_coefficient(components_of(elaboration, name).front());
  const bool is_mask = coefficient ? coefficient->is_mask : elaboration.masks.moving.contains(name);
  if (is_mask || (coefficient && coefficient->is_control())) return is_mask ? "it is a mask" : "it is a control";
  if (giver.value == nullptr) return "it has no formula";
  if (giver.is_projected) return "its formula is projected";
  const auto* tuple = std::get_if<ast::Tuple>(&(*giver.value)->kind);
  const bool has_file = is_load(*giver.value) || (tuple && std::ranges::any_of(tuple->elements, is_load));
  return has_file ? "it is loaded" : "";
}

}  // namespace

void declare_scene_lets(Elaboration& elaboration) {
  for (const auto& [item, range] : items_of<ast::LetItem>(elaboration.blocks.scene->items)) {
    if (declare(elaboration, item.name, Role::let)) elaboration.names.scene_lets.emplace(item.name.name, &item.value);
  }
}

namespace formulas {

namespace {

TypedExpr put_in(FormulaScope& here, const std::string& name, SourceRange range,
                 const std::function<TypedExpr()>& formula) {
  if (const auto known = here.put_in.find(name); known != here.put_in.end()) return known->second;
  if (!here.open.insert(name).second) {
    here.elaboration.sink.report("used-before-value", range, {name}, "it depends on itself");
    return {};
  }
  if (here.open.size() > max_names_of_names) {
    if (!std::exchange(here.elaboration.names.are_too_deep, true))
      here.elaboration.sink.report("too-large", range, {},
                                   fmt::format("more than {} formulas name one another in a row", max_names_of_names));
    here.open.erase(name);
    return {};
  }
  const bool was_in_sum = std::exchange(here.is_in_sum, false);  // the formula is also used elsewhere
  TypedExpr value = formula();
  here.is_in_sum = was_in_sum;
  here.open.erase(name);
  if (is_too_large(here, value, range)) value = {};
  return here.put_in.emplace(name, std::move(value)).first->second;
}

}  // namespace

TypedExpr scene_let(FormulaScope& here, const std::string& name, SourceRange range) {
  if (stands_in_model(here.elaboration, range)) {
    here.elaboration.sink.report("not-allowed-here", range, {"let " + name + " of the scene", "a model"},
                                 fmt::format("write param {0} in the model, and {0} = ... in the scene", name));
    return {};
  }
  here.elaboration.params.used.insert(name);
  return put_in(here, name, range, [&] {
    const ast::Expr& formula = *here.elaboration.names.scene_lets.at(name);
    TypedExpr value = any(here, formula);
    value.unit = here.elaboration.measures.define(name, formula);
    return value;
  });
}

TypedExpr given(FormulaScope& here, const std::string& name, const Symbol& meaning, SourceRange range) {
  const Giver giver = giver_of(here.elaboration, name, meaning.role);
  const std::string why = obstacle(here.elaboration, name, meaning.role, giver);
  const std::string what = fmt::format("{} {}", word_for(meaning.role), name);
  if (!why.empty()) {
    here.elaboration.sink.report("not-allowed-here", range, {what, std::string(place_of(here.context))},
                                 fmt::format("a value of the scene is replaced by its formula, but {} has none to put "
                                             "in: {}",
                                             name, why));
    return {};
  }
  for (const std::string& from : components_of(here.elaboration, name)) {
    for (const std::string& in : components_of(here.elaboration, here.subject))
      here.elaboration.problem.remarks.put_in.emplace_back(from, in);
  }
  const std::string whole = vector_of(name);
  const bool is_part = !whole.empty() && here.elaboration.names.scope.find(whole);
  return put_in(here, name, range, [&] {
    if (!is_part) {
      const auto parts = components(here, *giver.value, name);
      if (!parts) return TypedExpr{};
      return TypedExpr{meaning.is_vector ? TypedExpr::Type::vector : TypedExpr::Type::number, *parts};
    }
    const TypedExpr value = any(here, *giver.value);
    const int axis = axis_of(here.elaboration, name.substr(whole.size() + 1));
    if (value.type == TypedExpr::Type::vector && axis < static_cast<int>(value.parts.size()))
      return number_of(value.parts[static_cast<std::size_t>(axis)]);
    return value;
  });
}

}  // namespace formulas

void check_scene_lets(Elaboration& elaboration) {
  FormulaScope scope{elaboration, FormulaContext::quantity, "a let of the scene"};
  for (const auto& [name, formula] : elaboration.names.scene_lets) {
    if (!elaboration.params.used.contains(name))
      formulas::any(scope, ast::Expr(ast::Node{ast::Name{name}, formula->range()}));
  }
}

}  // namespace dpde::model
