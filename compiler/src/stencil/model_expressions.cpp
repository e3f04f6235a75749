// SPDX-License-Identifier: Apache-2.0
// Questions about expressions of the model level.
#include "stencil/discretise.h"
#include "support/match.h"

namespace dpde::stencil {

void for_each_child(const model::Expr& e, const std::function<void(const model::Expr&)>& f) {
  match(
      e->kind, [](const model::Number&) {}, [](const model::Param&) {}, [](const model::Field&) {},
      [](const model::Coordinate&) {}, [&](const model::Neg& n) { f(n.operand); },
      [&](const model::Binary& b) {
        f(b.left);
        f(b.right);
      },
      [&](const model::Call& c) {
        for (const model::Expr& argument : c.arguments) f(argument);
      },
      [&](const model::Select& s) {
        f(s.condition);
        f(s.yes);
        f(s.no);
      },
      [&](const model::Derivative& d) { f(d.operand); },
      [&](const model::Advect& a) {
        for (const model::Expr& component : a.velocity) f(component);
        f(a.operand);
      },
      [&](const model::Reduce& r) { f(r.operand); });
}

void visit(const model::Expr& e, const std::function<void(const model::Expr&)>& f) {
  f(e);
  for_each_child(e, [&](const model::Expr& child) { visit(child, f); });
}

bool holds_field(const model::Expr& e) {
  bool found = false;
  visit(e, [&](const model::Expr& x) { found = found || std::holds_alternative<model::Field>(x->kind); });
  return found;
}

bool holds_derivative(const model::Expr& e) {
  bool found = false;
  visit(e, [&](const model::Expr& x) {
    found = found || std::holds_alternative<model::Derivative>(x->kind) ||
            std::holds_alternative<model::Advect>(x->kind);
  });
  return found;
}

bool is_number(const model::Expr& e, double value) {
  const auto* number = std::get_if<model::Number>(&e->kind);
  return number && number->value == value;
}

}  // namespace dpde::stencil
