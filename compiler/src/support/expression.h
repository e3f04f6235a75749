// SPDX-License-Identifier: Apache-2.0
// What expressions of the model, stencil and loop levels have in common: the handle, operators, and walks. A level has
// a struct Node with a variant `kind`, and says once, next to it,
//   for_each_child(node, f): f on each direct child, in the order of evaluation; f may change those of a mutable node;
//   rebuilt(node): the expression of a node whose children were changed.
#pragma once

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "support/function_ref.h"
#include "support/match.h"
#include "support/vocabulary.h"

namespace dpde {

/// Value handle of an immutable expression; never null. Equality is structural.
template <class Node>
class ExprOf {
 public:
  ExprOf(double value);  // NOLINT: a number is an expression
  explicit ExprOf(Node node);
  const Node& node() const { return *node_; }
  const Node* operator->() const { return node_.get(); }
  bool operator==(const ExprOf& other) const;

 private:
  std::shared_ptr<const Node> node_;
};

struct Literal {
  double value;
  bool operator==(const Literal&) const = default;
};
template <class E>
struct NegOf {
  E operand;
  bool operator==(const NegOf&) const = default;
};
template <class E>
struct BinaryOf {
  BinaryOp op;
  E left, right;
  bool operator==(const BinaryOf&) const = default;
};
template <class E>
struct CallOf {
  Fn fn;
  std::vector<E> arguments;
  bool operator==(const CallOf&) const = default;
};
/// if(condition, yes, no)
template <class E>
struct SelectOf {
  E condition, yes, no;
  bool operator==(const SelectOf&) const = default;
};

template <class Node>
ExprOf<Node>::ExprOf(double value) : ExprOf(Node{Literal{value}}) {}
template <class Node>
ExprOf<Node>::ExprOf(Node node) : node_(std::make_shared<const Node>(std::move(node))) {}
template <class Node>
bool ExprOf<Node>::operator==(const ExprOf& other) const {
  return node_ == other.node_ || *node_ == *other.node_;
}

/// The cases of for_each_child() for the operators above, in a match() over the kinds of a level.
template <class E, class F>
auto children_of_operators(const F& f) {
  return Overloaded{[&f](OneOf<NegOf<E>> auto& neg) { f(neg.operand); },
                    [&f](OneOf<BinaryOf<E>> auto& binary) { f(binary.left), f(binary.right); },
                    [&f](OneOf<CallOf<E>> auto& call) {
                      for (auto& argument : call.arguments) f(argument);
                    },
                    [&f](OneOf<SelectOf<E>> auto& select) { f(select.condition), f(select.yes), f(select.no); }};
}

/// The expression as one of this kind; nullptr: it is of another.
template <class Kind, class Node>
const Kind* as(const ExprOf<Node>& e) {
  return std::get_if<Kind>(&e->kind);
}
/// Whether the expression is of one of these kinds.
template <class... Kinds, class Node>
bool is(const ExprOf<Node>& e) {
  return is_one_of<Kinds...>(e->kind);
}
/// The value of a number; nullopt for all else.
template <class Node>
std::optional<double> literal_value(const ExprOf<Node>& e) {
  const Literal* literal = as<Literal>(e);
  return literal ? std::optional(literal->value) : std::nullopt;
}
template <class Node>
bool is_literal(const ExprOf<Node>& e, double value) {
  return literal_value(e) == value;
}

/// A function of an expression, as walks take it.
template <class Result, class Node>
using FunctionOf = std::type_identity_t<FunctionRef<Result(const ExprOf<Node>&)>>;

/// Calls `f` on each direct child.
template <class Node>
void for_each_child(const ExprOf<Node>& e, FunctionOf<void, Node> f) {
  for_each_child(e.node(), f);
}
/// Whether `f` is true for a direct child.
template <class Node>
bool any_child(const ExprOf<Node>& e, FunctionOf<bool, Node> f) {
  bool found = false;
  for_each_child(e.node(), [&](const ExprOf<Node>& child) { found = found || f(child); });
  return found;
}
/// `e` with each direct child replaced by the result of `f`.
template <class Node>
ExprOf<Node> map_children(const ExprOf<Node>& e, FunctionOf<ExprOf<Node>, Node> f) {
  if (!any_child(e, [](const ExprOf<Node>&) { return true; })) return e;
  Node node = e.node();
  for_each_child(node, [&](ExprOf<Node>& child) { child = f(child); });
  return rebuilt(std::move(node));
}
/// Calls `f` on `e` and all its descendants, parents first.
template <class Node>
void visit(const ExprOf<Node>& e, FunctionOf<void, Node> f) {
  f(e);
  for_each_child(e.node(), [&](const ExprOf<Node>& child) { visit(child, f); });
}
/// Whether `f` is true for `e` or one of its descendants.
template <class Node>
bool any_part(const ExprOf<Node>& e, FunctionOf<bool, Node> f) {
  return f(e) || any_child(e, [&](const ExprOf<Node>& child) { return any_part(child, f); });
}
/// Whether `e` or one of its descendants is of one of these kinds.
template <class... Kinds, class Node>
bool holds_any(const ExprOf<Node>& e) {
  return any_part(e, [](const ExprOf<Node>& part) { return is<Kinds...>(part); });
}

/// A kernel of the stencil level or a row of the loop level.
template <class T>
concept HasExpressions = requires(T& kernel) {
  kernel.lets, kernel.stores, kernel.sums, kernel.scatters;
};
/// Calls `f` on every expression: lets, stores, sums, displacements and values of scatters.
template <HasExpressions Kernel, class F>
void for_each_expression(Kernel& kernel, F&& f) {
  for (auto& let : kernel.lets) f(let.value);
  for (auto& store : kernel.stores) f(store.value);
  for (auto& sum : kernel.sums) f(sum.value);
  for (auto& scatter : kernel.scatters) {
    for (auto& displacement : scatter.target.displacement) f(displacement);
    f(scatter.value);
  }
}
/// The kernel with `f` applied to each of them, in this order.
template <HasExpressions Kernel, class F>
Kernel map_expressions(Kernel kernel, F&& f) {
  for_each_expression(kernel, [&](auto& e) { e = f(e); });
  return kernel;
}
/// Calls `f` on all nodes of all its expressions.
template <HasExpressions Kernel, class F>
void visit(const Kernel& kernel, const F& f) {
  for_each_expression(kernel, [&](const auto& e) { visit(e, f); });
}
/// Whether `f` is true for one of them.
template <HasExpressions Kernel, class F>
bool any_part(const Kernel& kernel, const F& f) {
  bool found = false;
  for_each_expression(kernel, [&](const auto& e) { found = found || any_part(e, f); });
  return found;
}

}  // namespace dpde
