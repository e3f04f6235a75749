// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/calls.h"

#include "support/match.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {

void add_calls(const Expr& e, std::set<std::string>& names) {
  match_some(e->kind, [&](const Call& c) { names.insert(c.callee); });
  for_each_part(e, [&](const Expr& part) { add_calls(part, names); });
}

void for_each_name(const Expr& e, const std::function<void(const std::string&)>& f) {
  match_some(e->kind, [&](const Name& n) { f(n.name); });
  for_each_part(e, [&](const Expr& part) { for_each_name(part, f); });
}

std::set<std::string> calls_of(const Model& model) {
  std::set<std::string> names;
  for (const Item& item : model.items) {
    match(
        item.kind, [&](const LetItem& let) { add_calls(let.value, names); },
        [&](const EquationItem& equation) { add_calls(equation.rhs, names); },
        [&](const SolvedItem& solved) {
          add_calls(solved.left, names);
          add_calls(solved.right, names);
          for (const Expr& start : solved.starts) add_calls(start, names);
          if (solved.preconditioner) add_calls(*solved.preconditioner, names);
        },
        [&](const ConstraintItem& constraint) {
          add_calls(constraint.value, names);
          for (const Expr& start : constraint.starts) add_calls(start, names);
          if (constraint.preconditioner) add_calls(*constraint.preconditioner, names);
        },
        [&](const HeldItem& held) { add_calls(held.value, names); },
        ignored<FieldItem, CoefficientItem, ParamItem, ControlItem>, [](const OutsideModels auto&) {});
  }
  return names;
}

std::set<std::string> calls_of(const Function& function) {
  std::set<std::string> names;
  add_calls(function.body, names);
  for (const AdjointItem& adjoint : function.adjoints) add_calls(adjoint.value, names);
  return names;
}

}  // namespace dpde::ast
