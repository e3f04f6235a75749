// SPDX-License-Identifier: Apache-2.0
#include "loop/expressions.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "support/leading_number.h"
#include "support/match.h"

namespace dpde::loop {

namespace {

Expr add(const Expr& a, const Expr& b) {
  if (is_literal(a, 0)) return b;
  if (is_literal(b, 0)) return a;
  if (const auto positive = without_minus(b)) return binary(BinaryOp::subtract, a, *positive);
  if (const Neg* neg = as<Neg>(a)) return binary(BinaryOp::subtract, b, neg->operand);
  return make(Binary{BinaryOp::add, a, b});
}

Expr subtract(const Expr& a, const Expr& b) {
  if (is_literal(a, 0)) return negate(b);
  if (is_literal(b, 0)) return a;
  if (const auto positive = without_minus(b)) return binary(BinaryOp::add, a, *positive);
  return make(Binary{BinaryOp::subtract, a, b});
}

}  // namespace

Expr make(Kind kind) { return Expr(Node{std::move(kind)}); }

Expr negate(const Expr& a) {
  if (const Neg* neg = as<Neg>(a)) return neg->operand;
  if (const std::optional<Expr> negated = negate_leading_number(a)) return *negated;
  return make(Neg{a});
}

Expr binary(BinaryOp op, const Expr& a, const Expr& b) {
  if (op == BinaryOp::add) return add(a, b);
  if (op == BinaryOp::subtract) return subtract(a, b);
  return make(Binary{op, a, b});
}

Expr product(const std::vector<Expr>& factors) {
  if (factors.empty()) return 1.0;
  Expr result = factors.front();
  for (std::size_t i = 1; i < factors.size(); ++i) result = make(Binary{BinaryOp::multiply, result, factors[i]});
  return result;
}

bool is_leaf(const Expr& e) { return is<Literal, Uniform, Param, Counter, Load, Local>(e); }

namespace {

template <class AnyNode, class F>
void on_children(AnyNode& node, const F& f) {
  match(
      node.kind, ignored<Literal, Uniform, Param, Counter, Load, Local, Inside>, children_of_operators<Expr>(f),
      [&](OneOf<Interp> auto& i) { std::ranges::for_each(i.displacement, f); },
      [&](OneOf<Rounded> auto& rounded) { f(rounded.operand); });
}

}  // namespace

void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f) { on_children(node, f); }
void for_each_child(Node& node, FunctionRef<void(Expr&)> f) { on_children(node, f); }

std::set<int> used_uniforms(const Row& row) {
  std::set<int> used;
  const auto look = [&](const Expr& e) {
    if (const Uniform* u = as<Uniform>(e)) used.insert(u->index);
  };
  for_each_expression(row, [&](const Expr& e) { visit(e, look); });
  return used;
}

std::vector<bool> counted_uniforms(const Module& module) {
  std::vector<bool> counted;
  for (const UniformDef& uniform : module.uniforms) {
    bool is_counted = false;
    visit(uniform.value, [&](const Expr& e) {
      const Uniform* other = as<Uniform>(e);
      const bool is_of_counted = other && counted[static_cast<std::size_t>(other->index)];
      is_counted = is_counted || is_of_counted || is<Counter>(e);
    });
    counted.push_back(is_counted);
  }
  return counted;
}

}  // namespace dpde::loop
