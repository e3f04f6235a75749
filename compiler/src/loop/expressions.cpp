// SPDX-License-Identifier: Apache-2.0
#include "loop/expressions.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "support/match.h"

namespace dpde::loop {

namespace {

bool is_product(const Binary& b) { return b.op == BinaryOp::multiply || b.op == BinaryOp::divide; }

/// A product that begins with a number, with that number negated.
std::optional<Expr> negate_leading_number(const Expr& e) {
  if (const Literal* number = std::get_if<Literal>(&e->kind)) return Expr(-number->value);
  const Binary* b = std::get_if<Binary>(&e->kind);
  if (!b || !is_product(*b)) return std::nullopt;
  const std::optional<Expr> left = negate_leading_number(b->left);
  if (!left) return std::nullopt;
  return make(Binary{b->op, *left, b->right});
}

bool leads_with_minus(const Expr& e) {
  if (const Literal* number = std::get_if<Literal>(&e->kind)) return number->value < 0;
  const Binary* b = std::get_if<Binary>(&e->kind);
  return b && is_product(*b) && leads_with_minus(b->left);
}

/// x when `e` is -x in any spelling.
std::optional<Expr> without_minus(const Expr& e) {
  if (const Neg* neg = std::get_if<Neg>(&e->kind)) return neg->operand;
  return leads_with_minus(e) ? negate_leading_number(e) : std::nullopt;
}

Expr add(const Expr& a, const Expr& b) {
  if (is_literal(a, 0)) return b;
  if (is_literal(b, 0)) return a;
  if (const auto positive = without_minus(b)) return binary(BinaryOp::subtract, a, *positive);
  if (const Neg* neg = std::get_if<Neg>(&a->kind)) return binary(BinaryOp::subtract, b, neg->operand);
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
  if (const Neg* neg = std::get_if<Neg>(&a->kind)) return neg->operand;
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

bool is_literal(const Expr& e, double value) {
  const Literal* literal = std::get_if<Literal>(&e->kind);
  return literal && literal->value == value;
}

bool is_leaf(const Expr& e) {
  return std::holds_alternative<Literal>(e->kind) || std::holds_alternative<Uniform>(e->kind) ||
         std::holds_alternative<Param>(e->kind) || std::holds_alternative<Counter>(e->kind) ||
         std::holds_alternative<Load>(e->kind) || std::holds_alternative<Local>(e->kind);
}

void for_each_child(const Expr& e, const std::function<void(const Expr&)>& f) {
  match(
      e->kind, ignored<Literal, Uniform, Param, Counter, Load, Local, Inside>,
      [&](const Interp& i) { std::for_each(i.displacement.begin(), i.displacement.end(), f); },
      [&](const OneOf<Neg, Rounded> auto& one) { f(one.operand); },
      [&](const Binary& b) {
        f(b.left);
        f(b.right);
      },
      [&](const Call& c) { std::for_each(c.arguments.begin(), c.arguments.end(), f); },
      [&](const Select& s) {
        f(s.condition);
        f(s.yes);
        f(s.no);
      });
}

Expr map_children(const Expr& e, const std::function<Expr(const Expr&)>& f) {
  const auto map_all = [&](std::vector<Expr> all) {
    for (Expr& one : all) one = f(one);
    return all;
  };
  return match(
      e->kind, [&](const Literal&) { return e; }, [&](const Uniform&) { return e; }, [&](const Param&) { return e; },
      [&](const Counter&) { return e; }, [&](const Load&) { return e; }, [&](const Local&) { return e; },
      [&](const Inside&) { return e; },
      [&](const Interp& i) {
        return make(Interp{i.grid, i.offset, map_all(i.displacement), i.along});
      },
      [&](const Neg& n) { return make(Neg{f(n.operand)}); },
      [&](const Rounded& r) { return make(Rounded{f(r.operand)}); },
      [&](const Binary& b) {
        const Expr left = f(b.left);  // before the right one, so that `f` sees a fixed order
        return make(Binary{b.op, left, f(b.right)});
      },
      [&](const Call& c) {
        return make(Call{c.fn, map_all(c.arguments)});
      },
      [&](const Select& s) {
        const Expr condition = f(s.condition), yes = f(s.yes);
        return make(Select{condition, yes, f(s.no)});
      });
}

void visit(const Expr& e, const std::function<void(const Expr&)>& f) {
  f(e);
  for_each_child(e, [&](const Expr& child) { visit(child, f); });
}

void for_each_expression(const Row& row, const std::function<void(const Expr&)>& f) {
  for (const Let& let : row.lets) f(let.value);
  for (const Store& store : row.stores) f(store.value);
  for (const Sum& sum : row.sums) f(sum.value);
  for (const Scatter& scatter : row.scatters) {
    for (const Expr& d : scatter.target.displacement) f(d);
    f(scatter.value);
  }
}

std::set<int> used_uniforms(const Row& row) {
  std::set<int> used;
  const auto look = [&](const Expr& e) {
    if (const Uniform* u = std::get_if<Uniform>(&e->kind)) used.insert(u->index);
  };
  for_each_expression(row, [&](const Expr& e) { visit(e, look); });
  return used;
}

std::vector<bool> counted_uniforms(const Module& module) {
  std::vector<bool> counted;
  for (const UniformDef& uniform : module.uniforms) {
    bool is_counted = false;
    visit(uniform.value, [&](const Expr& e) {
      const Uniform* other = std::get_if<Uniform>(&e->kind);
      const bool is_of_counted = other && counted[static_cast<std::size_t>(other->index)];
      is_counted = is_counted || is_of_counted || std::holds_alternative<Counter>(e->kind);
    });
    counted.push_back(is_counted);
  }
  return counted;
}

Row map_expressions(Row row, const std::function<Expr(const Expr&)>& f) {
  for (Let& let : row.lets) let.value = f(let.value);
  for (Store& store : row.stores) store.value = f(store.value);
  for (Sum& sum : row.sums) sum.value = f(sum.value);
  for (Scatter& scatter : row.scatters) {
    for (Expr& d : scatter.target.displacement) d = f(d);
    scatter.value = f(scatter.value);
  }
  return row;
}

}  // namespace dpde::loop
