// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/formula.h"

#include <vector>

#include "model/build.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/derivatives.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

using Table = Derivatives<Expr>;

Expr sum_of(const Expr& a, const Expr& b) {
  const auto* subtracted = as<Neg>(b);
  return subtracted ? minus(a, subtracted->operand) : plus(a, b);
}

/// f'(a)*a' for each argument that varies.
Expr slope_of_binary(const Binary& b, const Variable& by) {
  Expr slope = 0.0;
  for (const int index : {0, 1}) {
    const Expr of_part = slope_of(index == 0 ? b.left : b.right, by);
    if (!is_literal(of_part, 0)) slope = sum_of(slope, Table::times_partial(b.op, b.left, b.right, index, of_part));
  }
  return slope;
}

Expr slope_of_call(const Call& c, const Variable& by) {
  const Expr first = slope_of(c.arguments[0], by);
  if (c.fn != Fn::min && c.fn != Fn::max) return Table::times_partial(c.fn, c.arguments, 0, first);
  return select(Table::is_first(c.fn, c.arguments[0], c.arguments[1]), first, slope_of(c.arguments[1], by));
}

}  // namespace

double value_at(const Expr& formula, double coordinate) {
  return value_at(formula, std::array{coordinate, coordinate, coordinate});
}

bool is_formula(const Expr& e) {
  return !any_part(e, [](const Expr& part) { return !is<Number, Coordinate, Neg, Binary, Call, Select>(part); });
}

bool depends_on_axis(const Expr& formula, int axis) {
  return any_part(formula, [&](const Expr& part) {
    const auto* c = as<Coordinate>(part);
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
  if (is<Coordinate>(formula)) return place;
  if (const auto* neg = as<Neg>(formula)) return negate(same(neg->operand));
  if (const auto* b = as<Binary>(formula)) return binary(b->op, same(b->left), same(b->right));
  if (const auto* s = as<Select>(formula))
    return select(same(s->condition), same(s->yes), same(s->no), formula->origin);
  const auto* c = as<Call>(formula);
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
