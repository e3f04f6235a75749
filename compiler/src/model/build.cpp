// SPDX-License-Identifier: Apache-2.0
#include "model/build.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "support/match.h"
#include "support/maths/comparisons.h"
#include "support/names/derivative_names.h"

namespace dpde::model {

namespace {

template <class K>
Expr make(K kind, Origin origin) {
  return Expr(Node{std::move(kind), origin});
}

/// Operations on two numbers with the result 0 or 1; others keep their written form.
std::optional<Expr> fold(BinaryOp op, const Expr& left, const Expr& right, Origin origin) {
  const auto a = literal_value(left), b = literal_value(right);
  if (!a || !b) return std::nullopt;
  double result = 2;
  if (op == BinaryOp::add) result = *a + *b;
  if (op == BinaryOp::subtract) result = *a - *b;
  if (op == BinaryOp::multiply) result = *a * *b;
  if (op == BinaryOp::divide && *b != 0) result = *a / *b;
  if (result != 0 && result != 1) return std::nullopt;
  return number(result, origin);
}

std::optional<Expr> by_identity(BinaryOp op, const Expr& left, const Expr& right, Origin origin) {
  const auto is = [](const Expr& e, double value) { return is_literal(e, value); };
  if (op == BinaryOp::add) {
    if (is(left, 0)) return right;
    if (is(right, 0)) return left;
  }
  if (op == BinaryOp::subtract) {
    if (is(right, 0)) return left;
    if (is(left, 0)) return negate(right, origin);
  }
  if (op == BinaryOp::multiply) {
    if (is(left, 0) || is(right, 0)) return number(0, origin);
    if (is(left, 1)) return right;
    if (is(right, 1)) return left;
  }
  if (op == BinaryOp::divide) {
    if (is(left, 0) && !is(right, 0)) return number(0, origin);
    if (is(right, 1)) return left;
  }
  if (op == BinaryOp::power) {
    if (is(right, 1)) return left;
    if (is(right, 0)) return number(1, origin);
  }
  return std::nullopt;
}

}  // namespace

Expr number(double value, Origin origin) { return make(Number{value}, origin); }
Expr param(std::string name, Origin origin) { return make(Param{std::move(name)}, origin); }
Expr field(std::string name, Origin origin) { return make(Field{std::move(name)}, origin); }
Expr coordinate(int axis, Origin origin) { return make(Coordinate{axis}, origin); }
Expr noise(std::uint64_t seed, Origin origin) { return make(Noise{seed}, origin); }

Expr negate(const Expr& operand, Origin origin) {
  if (is_literal(operand, 0)) return operand;
  if (const auto* neg = as<Neg>(operand)) return neg->operand;
  return make(Neg{operand}, origin);
}

Expr binary(BinaryOp op, const Expr& left, const Expr& right, Origin origin) {
  if (const auto folded = fold(op, left, right, origin)) return *folded;
  if (const auto simpler = by_identity(op, left, right, origin)) return *simpler;
  return make(Binary{op, left, right}, origin);
}

Expr plus(const Expr& a, const Expr& b, Origin origin) { return binary(BinaryOp::add, a, b, origin); }
Expr minus(const Expr& a, const Expr& b, Origin origin) { return binary(BinaryOp::subtract, a, b, origin); }
Expr times(const Expr& a, const Expr& b, Origin origin) { return binary(BinaryOp::multiply, a, b, origin); }
Expr over(const Expr& a, const Expr& b, Origin origin) { return binary(BinaryOp::divide, a, b, origin); }

Expr call(Fn fn, std::vector<Expr> arguments, Origin origin) { return make(Call{fn, std::move(arguments)}, origin); }

Expr select(const Expr& condition, const Expr& yes, const Expr& no, Origin origin) {
  return make(Select{condition, yes, no}, origin);
}

Expr derivative(const Expr& operand, int axis, int order, Origin origin) {
  if (is_uniform(operand)) return number(0, origin);
  if (order > 2) return derivative(derivative(operand, axis, 2, origin), axis, order - 2, origin);
  return make(Derivative{operand, axis, order}, origin);
}

Expr advect(std::vector<Expr> velocity, const Expr& operand, Origin origin) {
  const auto is_zero = [](const Expr& component) { return is_literal(component, 0); };
  if (is_uniform(operand) || std::all_of(velocity.begin(), velocity.end(), is_zero)) return number(0, origin);
  return make(Advect{std::move(velocity), operand}, origin);
}

Expr shift(const Expr& operand, std::vector<int> offset, Origin origin) {
  const bool stays = std::all_of(offset.begin(), offset.end(), [](int cells) { return cells == 0; });
  if (is_uniform(operand) || stays) return operand;
  return make(Shift{operand, std::move(offset)}, origin);
}

Expr interpolate(const Expr& operand, Origin origin) {
  if (is_uniform(operand)) return operand;
  return make(Interpolate{operand}, origin);
}

/// A constant is the wave of wavenumber 0.
Expr band_pass(BandPass value, Origin origin) {
  if (is_uniform(value.operand)) return value.first == 0 ? value.operand : number(0, origin);
  return make(std::move(value), origin);
}

Expr sample(Sample value, Origin origin) { return make(std::move(value), origin); }

Expr reduce(Reduce::Kind reduction, const Expr& operand, Origin origin) {
  return make(Reduce{reduction, operand}, origin);
}

std::string seed_of(const Operator& function, std::size_t component) {
  return bar_of(function.name) + (function.body.size() == 1 ? "" : std::string(".") + "xyz"[component]);
}

Expr apply(Apply application, Origin origin) { return make(std::move(application), origin); }

Expr network_call(NetworkCall inference, Origin origin) { return make(std::move(inference), origin); }

Expr solve(Solve solved, Origin origin) { return make(std::move(solved), origin); }
Expr without_aids(const Solve& solved, Origin origin) {
  Solve copy = solved;
  if (!copy.iterations) copy.starts.clear();
  if (!copy.iterations) copy.preconditioner.reset();
  return solve(std::move(copy), origin);
}

Expr reduce(Reduce reduction, Origin origin) { return make(std::move(reduction), origin); }

Expr slope_of_tanh(const Expr& a) { return over(1.0, binary(BinaryOp::power, call(Fn::cosh, {a}), 2.0)); }

bool is_condition(const Expr& e) {
  const auto* b = as<Binary>(e);
  return b != nullptr && (is_comparison(b->op) || is_logical(b->op));
}

bool is_uniform(const Expr& e) { return !holds_any<Field, Coordinate, Noise, Reduce, NetworkCall, Solve>(e); }

namespace {

/// `f` on each direct child, which it may change where the node may be changed: the one place that knows where they
/// are.
template <class AnyNode, class F>
void on_children(AnyNode& node, const F& f) {
  const auto on_all = [&](auto& parts) {
    for (auto& part : parts) f(part);
  };
  match(
      node.kind, ignored<Number, Param, Field, Coordinate, Noise>, children_of_operators<Expr>(f),
      [&](OneOf<Derivative, Shift, Interpolate, BandPass, Reduce> auto& one) { f(one.operand); },
      [&](OneOf<Apply, NetworkCall> auto& call) { on_all(call.arguments); },
      [&](OneOf<Advect> auto& a) { on_all(a.velocity), f(a.operand); }, [&](OneOf<Sample> auto& s) { on_all(s.place); },
      [&](OneOf<Solve> auto& s) {
        f(s.operation), f(s.right), on_all(s.starts);
        if (s.preconditioner) f(*s.preconditioner);
        for (auto& sides : s.boundary) {
          for (auto* side : {&sides.low, &sides.high}) f(side->value), f(side->a), f(side->b);
        }
      });
}

}  // namespace

void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f) { on_children(node, f); }
void for_each_child(Node& node, FunctionRef<void(Expr&)> f) { on_children(node, f); }

bool is_larger_than(const Expr& e, int max_nodes, int max_height) {
  int nodes = 0;
  const std::function<bool(const Expr&, int)> fits = [&](const Expr& part, int height) {
    if (++nodes > max_nodes || height > max_height) return false;
    bool all_fit = true;
    for_each_child(part, [&](const Expr& child) { all_fit = all_fit && fits(child, height + 1); });
    return all_fit;
  };
  return !fits(e, 1);
}

int nested_order(const Expr& e) {
  int inside = 0;
  for_each_child(e, [&](const Expr& part) { inside = std::max(inside, nested_order(part)); });
  const auto* derivative = as<Derivative>(e);
  if (derivative) return inside + derivative->order;
  return is<Advect>(e) ? inside + 1 : inside;
}

bool reads(const Expr& e, const std::string& field) {
  return any_part(e, [&](const Expr& part) {
    const auto* found = as<Field>(part);
    const auto* at_a_place = as<Sample>(part);
    return (found && found->name == field) || (at_a_place && at_a_place->field == field);
  });
}

namespace {

void collect_terms(const Expr& e, bool negative, std::vector<Term>& terms) {
  if (const auto* neg = as<Neg>(e)) return collect_terms(neg->operand, !negative, terms);
  const auto* b = as<Binary>(e);
  if (b && (b->op == BinaryOp::add || b->op == BinaryOp::subtract)) {
    collect_terms(b->left, negative, terms);
    collect_terms(b->right, negative != (b->op == BinaryOp::subtract), terms);
    return;
  }
  terms.push_back({e, negative});
}

}  // namespace

std::vector<Term> terms_of(const Expr& e) {
  std::vector<Term> terms;
  collect_terms(e, false, terms);
  return terms;
}

std::optional<Linear> linear_in(const Expr& e, const std::string& field) {
  if (!reads(e, field)) return Linear{e, 0.0};
  if (is<Field>(e)) return Linear{0.0, 1.0};
  if (const auto* neg = as<Neg>(e)) {
    const auto inner = linear_in(neg->operand, field);
    return inner ? std::optional(Linear{negate(inner->rest), negate(inner->factor)}) : std::nullopt;
  }
  const auto* b = as<Binary>(e);
  if (!b) return std::nullopt;
  const auto left = linear_in(b->left, field), right = linear_in(b->right, field);
  if (!left || !right) return std::nullopt;
  const auto both = [&](const Linear& x, const Linear& y) {
    return Linear{binary(b->op, x.rest, y.rest), binary(b->op, x.factor, y.factor)};
  };
  const bool is_sum = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
  if (is_sum) return both(*left, *right);
  if (b->op == BinaryOp::multiply && !reads(b->left, field)) return both({b->left, b->left}, *right);
  const bool scales = b->op == BinaryOp::multiply || b->op == BinaryOp::divide;
  return scales && !reads(b->right, field) ? std::optional(both(*left, {b->right, b->right})) : std::nullopt;
}

bool is_spectral(const Scheme& scheme, const Expr& e) {
  if (const Advect* advect = as<Advect>(e)) return is_spectral(transport_of(scheme, *advect));
  const Derivative* d = as<Derivative>(e);
  return d != nullptr && (d->order % 2 == 0 ? scheme.laplacian_order : scheme.derivative_order) == spectral;
}

const Transport& transport_of(const Scheme& scheme, const Advect& e) {
  const auto* field = as<Field>(e.operand);
  return field ? scheme.transport_of(field->name) : scheme.transport;
}

}  // namespace dpde::model
