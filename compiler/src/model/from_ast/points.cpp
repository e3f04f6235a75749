// SPDX-License-Identifier: Apache-2.0
// Points between cells: inject(f, at = (x0, y0)), a density whose sum over the cells times their volume is f. It is
// spelled out here in functions that exist, so that discretising and differentiating it need no rule of their own.
#include <fmt/format.h>

#include "model/build.h"
#include "model/from_ast/constants.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

Expr times(const Expr& a, const Expr& b) { return binary(BinaryOp::multiply, a, b); }
Expr plus(const Expr& a, const Expr& b) { return binary(BinaryOp::add, a, b); }
Expr minus(const Expr& a, const Expr& b) { return binary(BinaryOp::subtract, a, b); }
Expr larger(const Expr& a, const Expr& b) { return call(Fn::max, {a, b}); }
Expr smaller(const Expr& a, const Expr& b) { return call(Fn::min, {a, b}); }

/// hx, hy, hz: bound by the grid that the scene is run on.
Expr spacing(int axis) { return param("h" + axis_name(axis)); }

/// 1 - |p| where that is positive, else 0. By the rules for ties its slope at -1, 0 and 1 is the one towards smaller p,
/// which is the right-hand one in the position of the point, as `interp` has it.
Expr hat(const Expr& p) { return larger(smaller(minus(1.0, p), larger(0.0, plus(1.0, p))), 0.0); }

/// What a cell takes of a point at `position` along an axis. Along a periodic axis the point has images one period away;
/// within half a cell of a wall all belongs to the cell there.
Expr weight_along(const Axis& axis, int number_of_axis, const Expr& position) {
  const Expr h = spacing(number_of_axis), half = binary(BinaryOp::divide, h, 2.0);
  const auto hat_at = [&](const Expr& point) {
    return hat(binary(BinaryOp::divide, minus(coordinate(number_of_axis), point), h));
  };
  if (axis.topology == Topology::bounded) {
    return hat_at(smaller(larger(position, plus(axis.low, half)), minus(axis.high, half)));
  }
  const double period = axis.high - axis.low;
  return plus(plus(hat_at(position), hat_at(minus(position, period))), hat_at(plus(position, period)));
}

/// Whether `e` has the same value in every run: neither t nor an unknown nor a parameter without a value is in it.
bool is_fixed(const Draft& draft, const Expr& e) {
  return !any_part(e, [&](const Expr& part) {
    const auto* param = std::get_if<Param>(&part->kind);
    if (!param) return false;
    const auto value = draft.values.find(param->name);
    return draft.unknowns.contains(param->name) || value == draft.values.end() || !value->second;
  });
}

}  // namespace

std::optional<std::vector<Expr>> Expressions::point(const ast::Call& e) {
  if (e.arguments.size() != 2 || !e.arguments[0].name.empty() || e.arguments[1].name != "at") {
    draft_.sink.report("wrong-argument-count", e.callee_range,
                       {e.callee, "a formula and a place", "this"},
                       axis_count() == 1 ? fmt::format("write {}(f, at = x0)", e.callee)
                                         : fmt::format("write {}(f, at = (x0, y0{}))", e.callee, axis_count() == 3 ? ", z0" : ""));
    return std::nullopt;
  }
  const char* hint = "points between cells are found on uniform axes; a density is exp(-((y - y0)/w)^2)";
  if (refuses_stretched(draft_, e.callee, e.callee_range, hint)) return std::nullopt;
  const ast::Expr& place = e.arguments[1].value;
  const auto position = as_vector(any(place), place.range());
  if (!position) return std::nullopt;
  for (int axis = 0; axis < axis_count(); ++axis) {
    const Expr& along = (*position)[axis];
    const Axis& grid = draft_.problem.axes[axis];
    if (!is_uniform(along)) {
      draft_.sink.report("not-allowed-here", place.range(), {"what differs from cell to cell", "the place of a point"},
                         "a place is made of numbers, parameters and t");
      return std::nullopt;
    }
    if (!is_fixed(draft_, along)) continue;
    const Value value = value_of(along, draft_.values);
    if (value.mistake.empty() && value.number >= grid.low && value.number <= grid.high) continue;
    draft_.sink.report("outside-the-grid", place.range(),
                       {e.callee, fmt::format("{} = {}", grid.name, value.number)},
                       fmt::format("axis {} reaches from {} to {}", grid.name, grid.low, grid.high));
    return std::nullopt;
  }
  return position;
}

Typed Expressions::injection(const ast::Call& e, SourceRange range) {
  if (purpose_ != Purpose::equation) return refuse("the point source inject", e.callee_range);
  const auto position = point(e);
  const auto strength = e.arguments.empty() ? std::nullopt : as_number(any(e.arguments[0].value), e.arguments[0].value.range());
  if (!position || !strength) return {};
  ++draft_.injections;
  Expr volume = 1.0;
  Expr weight = 1.0;
  for (int axis = 0; axis < axis_count(); ++axis) {
    weight = times(weight, weight_along(draft_.problem.axes[axis], axis, (*position)[axis]));
    volume = times(volume, spacing(axis));
  }
  return {Typed::Type::number, {binary(BinaryOp::divide, times(*strength, weight), volume, {range})}};
}

Typed Expressions::sampling(const ast::Call& e, SourceRange range) {
  if (purpose_ != Purpose::quantity) return refuse("the point value sample", e.callee_range);
  const auto position = point(e);
  if (!position) return {};
  const auto operand = as_number(any(e.arguments[0].value), e.arguments[0].value.range());
  if (!operand) return {};
  const Field* field = std::get_if<Field>(&(*operand)->kind);
  if (field) return {Typed::Type::number, {sample(field->name, *position, {range})}};
  draft_.sink.report("not-allowed-here", e.arguments[0].value.range(), {"a formula", "sample"},
                     "sample one field, and calculate with what comes of it");
  return {};
}

namespace {

bool holds_sample(const Expr& e) {
  return any_part(e, [](const Expr& part) { return std::holds_alternative<Sample>(part->kind); });
}

/// Marks a datum as one number a state; false when `field` is no datum.
bool is_series(Draft& draft, const std::string& field) {
  if (!draft.problem.task) return false;
  for (Datum& datum : draft.problem.task->data) {
    if (datum.name == field) return datum.series = true;
  }
  return false;
}

}  // namespace

Expr over_one_cell(Draft& draft, const Expr& e) {
  if (const auto* neg = std::get_if<Neg>(&e->kind)) return negate(over_one_cell(draft, neg->operand), e->origin);
  if (holds_reduction(e)) {
    const auto* b = std::get_if<Binary>(&e->kind);
    if (!b) return e;
    return binary(b->op, over_one_cell(draft, b->left), over_one_cell(draft, b->right), e->origin);
  }
  if (!holds_sample(e)) return e;
  const bool at_a_point = !any_part(e, [&](const Expr& part) {
    const auto* field = std::get_if<Field>(&part->kind);
    return std::holds_alternative<Coordinate>(part->kind) || (field && !is_series(draft, field->name));
  });
  if (!at_a_point) return e;
  std::optional<Expr> first;
  for (int axis = 0; axis < static_cast<int>(draft.problem.axes.size()); ++axis) {
    const Axis& grid = draft.problem.axes[axis];
    const Expr here = binary(BinaryOp::less, coordinate(axis), plus(grid.low, spacing(axis)));
    first = first ? binary(BinaryOp::logical_and, *first, here) : here;
  }
  return reduce(Reduce::Kind::sum, select(*first, e, 0.0), e->origin);
}

}  // namespace dpde::model
