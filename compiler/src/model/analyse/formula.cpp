// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/formula.h"

#include <vector>

#include "model/build.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

Expr square(const Expr& a) { return binary(BinaryOp::power, a, 2.0); }

Expr slope_of_binary(const Binary& b, const Variable& by) {
  const Expr left = slope_of(b.left, by), right = slope_of(b.right, by);
  switch (b.op) {
    case BinaryOp::add: return plus(left, right);
    case BinaryOp::subtract: return minus(left, right);
    case BinaryOp::multiply: return plus(times(left, b.right), times(b.left, right));
    case BinaryOp::divide:
      if (is_constant(right, 0)) return over(left, b.right);
      return over(minus(times(left, b.right), times(b.left, right)), square(b.right));
    case BinaryOp::power: {
      const Expr by_base = times(times(b.right, binary(BinaryOp::power, b.left, minus(b.right, 1.0))), left);
      if (is_constant(right, 0)) return by_base;
      return plus(by_base, times(times(binary(b.op, b.left, b.right), call(Fn::log, {b.left})), right));
    }
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return 0.0;
  }
  unreachable("operator");
}

/// The derivative by the single argument.
Expr slope_of_function(Fn fn, const Expr& x) {
  switch (fn) {
    case Fn::sin: return call(Fn::cos, {x});
    case Fn::cos: return negate(call(Fn::sin, {x}));
    case Fn::tan: return over(1.0, square(call(Fn::cos, {x})));
    case Fn::asin: return over(1.0, call(Fn::sqrt, {minus(1.0, square(x))}));
    case Fn::acos: return over(-1.0, call(Fn::sqrt, {minus(1.0, square(x))}));
    case Fn::atan: return over(1.0, plus(1.0, square(x)));
    case Fn::sinh: return call(Fn::cosh, {x});
    case Fn::cosh: return call(Fn::sinh, {x});
    case Fn::tanh: return over(1.0, square(call(Fn::cosh, {x})));  // 1 - tanh^2 would cancel where tanh is near 1
    case Fn::exp: return call(Fn::exp, {x});
    case Fn::log: return over(1.0, x);
    case Fn::sqrt: return over(0.5, call(Fn::sqrt, {x}));
    case Fn::abs: return call(Fn::sign, {x});
    case Fn::sign:
    case Fn::floor: return 0.0;
    case Fn::fraction: return 1.0;
    case Fn::min:
    case Fn::max: break;
  }
  unreachable("a function of two arguments");
}

Expr slope_of_call(const Call& c, const Variable& by) {
  if (c.fn != Fn::min && c.fn != Fn::max)
    return times(slope_of_function(c.fn, c.arguments[0]), slope_of(c.arguments[0], by));
  const BinaryOp takes_first = c.fn == Fn::min ? BinaryOp::less : BinaryOp::greater;
  const Expr condition = binary(takes_first, c.arguments[0], c.arguments[1]);
  return select(condition, slope_of(c.arguments[0], by), slope_of(c.arguments[1], by));
}

}  // namespace

double value_at(const Expr& formula, double coordinate) {
  return value_at(formula, std::array{coordinate, coordinate, coordinate});
}

bool is_formula(const Expr& e) {
  return !any_part(e, [](const Expr& part) {
    return !std::holds_alternative<Number>(part->kind) && !std::holds_alternative<Coordinate>(part->kind) &&
           !std::holds_alternative<Neg>(part->kind) && !std::holds_alternative<Binary>(part->kind) &&
           !std::holds_alternative<Call>(part->kind) && !std::holds_alternative<Select>(part->kind);
  });
}

bool depends_on_axis(const Expr& formula, int axis) {
  return any_part(formula, [&](const Expr& part) {
    const auto* c = std::get_if<Coordinate>(&part->kind);
    return c != nullptr && c->axis == axis;
  });
}

double value_at(const Expr& formula, const std::array<double, 3>& place) {
  const auto value = [&](const Expr& part) { return value_at(part, place); };
  const auto none = [](const auto&) -> double { unreachable("no formula of a coordinate"); };
  return match(
      formula->kind, [](const Number& n) { return n.value; },
      [&](const Coordinate& c) { return place[static_cast<std::size_t>(c.axis)]; },
      [&](const Neg& n) { return -value(n.operand); },
      [&](const Binary& b) { return evaluate_binary(b.op, value(b.left), value(b.right)); },
      [&](const Call& c) { return evaluate_call_of(c.fn, c.arguments, value); },
      [&](const Select& s) { return value(value(s.condition) != 0 ? s.yes : s.no); },
      [&](const Param& e) { return none(e); }, [&](const Field& e) { return none(e); },
      [&](const Noise& e) { return none(e); }, [&](const Derivative& e) { return none(e); },
      [&](const Advect& e) { return none(e); }, [&](const Shift& e) { return none(e); },
      [&](const Interpolate& e) { return none(e); }, [&](const BandPass& e) { return none(e); },
      [&](const Sample& e) { return none(e); }, [&](const Reduce& e) { return none(e); },
      [&](const Apply& e) { return none(e); }, [&](const NetworkCall& e) { return none(e); },
      [&](const Solve& e) { return none(e); });
}

Expr at_place(const Expr& formula, const Expr& place) {
  const auto same = [&](const Expr& part) { return at_place(part, place); };
  if (std::holds_alternative<Coordinate>(formula->kind)) return place;
  if (const auto* neg = std::get_if<Neg>(&formula->kind)) return negate(same(neg->operand));
  if (const auto* b = std::get_if<Binary>(&formula->kind)) return binary(b->op, same(b->left), same(b->right));
  if (const auto* s = std::get_if<Select>(&formula->kind))
    return select(same(s->condition), same(s->yes), same(s->no), formula->origin);
  const auto* c = std::get_if<Call>(&formula->kind);
  if (!c) return formula;
  std::vector<Expr> arguments;
  for (const Expr& argument : c->arguments) arguments.push_back(same(argument));
  return call(c->fn, std::move(arguments), formula->origin);
}

Expr slope_of(const Expr& formula, const Variable& by) {
  const auto none = [](const auto&) -> Expr { unreachable("no formula of a coordinate"); };
  return match(
      formula->kind, [](const Number&) { return Expr(0.0); },
      [&](const Coordinate& c) { return Expr(!by.is_time && by.axis.value_or(c.axis) == c.axis ? 1.0 : 0.0); },
      [&](const Param& p) { return Expr(by.is_time && p.name == "t" ? 1.0 : 0.0); },
      [&](const Neg& n) { return negate(slope_of(n.operand, by)); },
      [&](const Binary& b) { return slope_of_binary(b, by); }, [&](const Call& c) { return slope_of_call(c, by); },
      [&](const Select& s) { return select(s.condition, slope_of(s.yes, by), slope_of(s.no, by)); },
      [&](const Field& e) { return none(e); }, [&](const Noise& e) { return none(e); },
      [&](const Derivative& e) { return none(e); }, [&](const Advect& e) { return none(e); },
      [&](const Shift& e) { return none(e); }, [&](const Interpolate& e) { return none(e); },
      [&](const BandPass& e) { return none(e); }, [&](const Sample& e) { return none(e); },
      [&](const Reduce& e) { return none(e); }, [&](const Apply& e) { return none(e); },
      [&](const NetworkCall& e) { return none(e); }, [&](const Solve& e) { return none(e); });
}

}  // namespace dpde::model
