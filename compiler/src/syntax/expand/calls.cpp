// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/calls.h"

#include "support/match.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {

void add_calls(const Expr& e, std::set<std::string>& names) {
  match(
      e->kind, [](const Number&) {}, [](const Text&) {}, [](const Name&) {}, [](const Offsets&) {}, [](const Error&) {},
      [&](const Unary& u) { add_calls(u.operand, names); },
      [&](const Binary& b) {
        add_calls(b.left, names);
        add_calls(b.right, names);
      },
      [&](const Call& c) {
        names.insert(c.callee);
        for (const Argument& argument : c.arguments) add_calls(argument.value, names);
      },
      [&](const Tuple& t) {
        for (const Expr& element : t.elements) add_calls(element, names);
      },
      [&](const Component& c) { add_calls(c.operand, names); });
}

void for_each_name(const Expr& e, const std::function<void(const std::string&)>& f) {
  match(
      e->kind, [](const Number&) {}, [](const Text&) {}, [&](const Name& n) { f(n.name); },
      [&](const Unary& u) { for_each_name(u.operand, f); },
      [&](const Binary& b) {
        for_each_name(b.left, f);
        for_each_name(b.right, f);
      },
      [&](const Call& c) {
        for (const Argument& argument : c.arguments) for_each_name(argument.value, f);
      },
      [&](const Tuple& t) {
        for (const Expr& element : t.elements) for_each_name(element, f);
      },
      [&](const Component& c) { for_each_name(c.operand, f); }, [](const Offsets&) {}, [](const Error&) {});
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
        [&](const HeldItem& held) { add_calls(held.value, names); }, [](const FieldItem&) {},
        [](const CoefficientItem&) {}, [](const ParamItem&) {}, [](const ControlItem&) {},
        [](const OutsideModels auto&) {});
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
