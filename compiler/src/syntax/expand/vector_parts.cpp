// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/vector_parts.h"

#include <algorithm>

namespace dpde::ast {

namespace {

bool is_file(const Expr& value) {
  const auto* call = std::get_if<Call>(&value->kind);
  return call != nullptr && call->callee == "load";
}

/// Component name: u.x for u, dt(u.x) for dt(u).
std::string part_name(const std::string& whole, const std::string& axis) {
  const bool is_rate = whole.ends_with(")");
  return whole.substr(0, whole.size() - (is_rate ? 1 : 0)) + "." + axis + (is_rate ? ")" : "");
}

/// Component of a tuple; a number, such as 0, applies to all components.
Expr part_of(const Expr& value, std::size_t index, const std::vector<std::string>& axes) {
  const SourceRange range = value.range();
  const auto* tuple = std::get_if<Tuple>(&value->kind);
  if (tuple != nullptr && tuple->elements.size() == axes.size()) return tuple->elements[index];
  if (std::holds_alternative<Number>(value->kind) || axes.size() == 1) return value;
  if (const auto* name = std::get_if<Name>(&value->kind))
    return Expr(Node{Name{part_name(name->name, axes[index])}, range});
  return Expr(Node{Component{value, {axes[index], range}}, range});
}

}  // namespace

Given given_by(Item& item) {
  if (auto* initial = get_if<InitialItem>(&item.kind)) return {&initial->field, &initial->value};
  if (auto* exact = get_if<ExactItem>(&item.kind)) return {&exact->field, &exact->value};
  if (auto* value = get_if<ValueItem>(&item.kind)) return {&value->name, &value->value};
  if (auto* boundary = get_if<BoundaryItem>(&item.kind)) return {&boundary->field, nullptr};
  return {};
}

std::string whole_of(const std::string& name) {
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos) return "";
  return name.substr(0, dot) + (name.ends_with(")") ? ")" : "");
}

std::vector<Item> parts_of(const Item& item, const std::vector<std::string>& axes) {
  std::vector<Item> parts;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    Item& part = parts.emplace_back(item);
    const Given given = given_by(part);
    if (given.value != nullptr && is_file(*given.value)) return {item};
    given.name->name = part_name(given.name->name, axes[i]);
    if (given.value != nullptr) *given.value = part_of(*given.value, i, axes);
    auto* boundary = get_if<BoundaryItem>(&part.kind);
    if (boundary == nullptr) continue;
    boundary->bare = false;
    for (BoundarySide& side : boundary->sides) {  // words such as zero_gradient apply to each component
      if (std::holds_alternative<Tuple>(side.value->kind)) side.value = part_of(side.value, i, axes);
    }
  }
  return parts;
}

}  // namespace dpde::ast
