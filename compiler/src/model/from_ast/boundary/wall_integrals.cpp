// SPDX-License-Identifier: Apache-2.0
// integral(k*dy(T), at = y.low): the flux through a wall.
//
// On a wall a field at cell centres is the mean of the first cell and its ghost value, and its derivative across the
// wall is their difference. div(k*grad(T)) and lap(T) use the same flux, so the integral over a wall balances the
// change of the field. If such terms act on the field, both approximations are of second order. The ghost value of a
// field determined by a constraint has zero slope, which carries no information; its wall value is extrapolated from
// the first cells. So is the derivative of a field that lies on the wall itself.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <variant>

#include "model/boundary/stretch.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"
#include "support/match.h"

namespace dpde::model {

namespace {

struct Wall {
  int axis;
  bool is_low;
};

std::vector<std::string> wall_names(const Problem& problem) {
  std::vector<std::string> names;
  for (const Axis& axis : problem.axes) {
    if (axis.topology != Topology::bounded) continue;
    names.push_back(axis.name + ".low");
    names.push_back(axis.name + ".high");
  }
  return names;
}

Expr sum_of(const std::vector<std::pair<double, Expr>>& terms, const Origin& origin) {
  Expr sum = 0.0;
  for (const auto& [weight, value] : terms)
    sum = binary(BinaryOp::add, sum, binary(BinaryOp::multiply, weight, value), origin);
  return sum;
}

/// Evaluates an expression on a wall, in the row of cells next to it.
class OnWall {
 public:
  OnWall(const Elaboration& elaboration, Wall wall)
      : elaboration_(elaboration), wall_(wall), axis_(elaboration.problem.axes[static_cast<std::size_t>(wall.axis)]) {}

  /// nullopt: `mistake` names the part that is not known there.
  std::optional<Expr> term(const Expr& e) {
    takes_all_on_it_ = reads_what_lies_on_it(e);
    return (*this)(e);
  }
  std::optional<Expr> operator()(const Expr& e) {
    if (is_uniform(e)) return e;
    if (const auto* taken = as<Interpolate>(e)) {  // values on the wall need no interpolation to it
      const bool is_brought = takes_all_on_it_ && !reads_what_lies_on_it(taken->operand);
      return is_brought ? std::optional(inside(e, row_of_wall())) : (*this)(taken->operand);
    }
    if (const auto* read = as<Field>(e)) return value(*read, e);
    if (is<Coordinate>(e)) {
      const bool is_across = std::get<Coordinate>(e->kind).axis == wall_.axis;
      return is_across ? Expr(wall_.is_low ? axis_.low : axis_.high) : e;
    }
    if (const auto* neg = as<Neg>(e)) {
      const auto operand = (*this)(neg->operand);
      return operand ? std::optional(negate(*operand, e->origin)) : std::nullopt;
    }
    if (const auto* b = as<Binary>(e)) {
      const auto left = (*this)(b->left), right = left ? (*this)(b->right) : std::nullopt;
      return right ? std::optional(binary(b->op, *left, *right, e->origin)) : std::nullopt;
    }
    if (const auto* c = as<Call>(e)) {
      std::vector<Expr> arguments;
      for (const Expr& argument : c->arguments) {
        const auto here = (*this)(argument);
        if (!here) return std::nullopt;
        arguments.push_back(*here);
      }
      return call(c->fn, std::move(arguments), e->origin);
    }
    const auto* d = as<Derivative>(e);
    if (d == nullptr || d->order != 1) return unknown(e);
    if (d->axis == wall_.axis) return across(d->operand);
    const auto operand = (*this)(d->operand);
    return operand ? std::optional(derivative(*operand, d->axis, 1, e->origin)) : std::nullopt;
  }

  Origin mistake;

 private:
  std::nullopt_t unknown(const Expr& e) {
    mistake = e->origin;
    return std::nullopt;
  }

  /// `field` shifted by `rows` rows into the grid.
  Expr inside(const Expr& field, int rows) const {
    std::vector<int> offset(elaboration_.problem.axes.size(), 0);
    offset[static_cast<std::size_t>(wall_.axis)] = wall_.is_low ? rows : -rows;
    return rows == 0 ? field : shift(field, std::move(offset), field->origin);
  }
  /// The row of values on the wall; one before the first row at a wall where the field has none.
  int row_of_wall() const { return axis_.holds_wall(wall_.is_low) ? 0 : -1; }

  bool reads_what_lies_on_it(const Expr& e) const {
    return any_part(e, [&](const Expr& part) {
      const auto* field = as<Field>(part);
      return field && lies_on_wall(field->name);
    });
  }

  bool lies_on_wall(const std::string& name) const {
    const State* state = elaboration_.problem.find_state(name);
    const Coefficient* coefficient = elaboration_.problem.find_coefficient(name);
    const Placement placement = state ? state->placement : coefficient ? coefficient->placement : Placement{};
    return placement[static_cast<std::size_t>(wall_.axis)];
  }

  /// A field determined by a constraint has a ghost value of zero slope, unless it is 0 on an open wall.
  bool is_extrapolated(const std::string& name) const {
    if (!elaboration_.solves.multipliers.contains(name)) return false;
    const AxisSides& sides = elaboration_.problem.find_state(name)->boundary[static_cast<std::size_t>(wall_.axis)];
    return !condition_of((wall_.is_low ? sides.low : sides.high).kind).gives_value();
  }

  /// In a product with a field that lies on the wall, the mean of both cells is the interpolated value.
  std::optional<Expr> value(const Field& read, const Expr& e) {
    if (lies_on_wall(read.name)) return inside(e, row_of_wall());
    if (takes_all_on_it_)
      return is_extrapolated(read.name) ? unknown(e) : std::optional(inside(interpolate(e, e->origin), row_of_wall()));
    if (is_extrapolated(read.name)) return sum_of({{1.5, e}, {-0.5, inside(e, 1)}}, e->origin);
    return sum_of({{0.5, e}, {0.5, inside(e, -1)}}, e->origin);
  }

  /// The derivative across the wall.
  std::optional<Expr> across(const Expr& e) {
    if (is_uniform(e)) return Expr(0.0);
    if (const auto* read = as<Field>(e)) return slope(*read, e);
    if (const auto* at = as<Coordinate>(e)) return Expr(at->axis == wall_.axis ? 1.0 : 0.0);
    if (const auto* neg = as<Neg>(e)) {
      const auto operand = across(neg->operand);
      return operand ? std::optional(negate(*operand, e->origin)) : std::nullopt;
    }
    const auto* b = as<Binary>(e);
    if (b == nullptr) return unknown(e);
    const auto left = across(b->left), right = left ? across(b->right) : std::nullopt;
    if (!right) return std::nullopt;
    if (b->op == BinaryOp::add || b->op == BinaryOp::subtract) return binary(b->op, *left, *right, e->origin);
    const auto first = (*this)(b->left), second = first ? (*this)(b->right) : std::nullopt;
    if (!second) return std::nullopt;
    if (b->op == BinaryOp::multiply)
      return binary(BinaryOp::add, binary(BinaryOp::multiply, *left, *second),
                    binary(BinaryOp::multiply, *first, *right), e->origin);
    if (b->op == BinaryOp::divide && is_uniform(b->right)) return binary(BinaryOp::divide, *left, *second, e->origin);
    return unknown(e);
  }

  std::optional<Expr> slope(const Field& read, const Expr& e) {
    const int wall = row_of_wall();
    if (takes_all_on_it_ && !lies_on_wall(read.name))
      return is_extrapolated(read.name) ? unknown(e)
                                        : std::optional(inside(derivative(e, wall_.axis, 1, e->origin), wall));
    std::vector<std::pair<double, Expr>> terms;  // (weight, value); direction into the grid, in units of the spacing
    if (lies_on_wall(read.name)) {
      terms = {{-1.5, inside(e, wall)}, {2, inside(e, wall + 1)}, {-0.5, inside(e, wall + 2)}};
    } else if (is_extrapolated(read.name)) {
      terms = {{-2, e}, {3, inside(e, 1)}, {-1, inside(e, 2)}};
    } else {
      terms = {{1, e}, {-1, inside(e, -1)}};
    }
    for (auto& [weight, value] : terms) weight = wall_.is_low ? weight : -weight;
    return binary(BinaryOp::divide, sum_of(terms, e->origin), spacing(), e->origin);
  }

  /// Spacing at the wall; on a stretched axis the uniform spacing times the slope of the map there.
  Expr spacing() const {
    if (!axis_.stretch) return param("h" + axis_.name);
    const double end = wall_.is_low ? axis_.low : axis_.high, near = 1e-6 * (axis_.high - axis_.low);
    const double slope = (axis_.place(end + near) - axis_.place(end - near)) / (2 * near);
    return binary(BinaryOp::multiply, slope, param(uniform_spacing_name(axis_)));
  }

  const Elaboration& elaboration_;
  Wall wall_;
  const Axis& axis_;
  bool takes_all_on_it_ = false;  // the term contains a field that lies on the wall
};

/// The terms of a sum with their constant factors; the terms may have different placements.
void add_terms(const Expr& e, const Expr& factor, std::vector<Expr>& terms) {
  if (const auto* neg = as<Neg>(e)) return add_terms(neg->operand, negate(factor), terms);
  const auto* b = as<Binary>(e);
  if (b && (b->op == BinaryOp::add || b->op == BinaryOp::subtract)) {
    add_terms(b->left, factor, terms);
    return add_terms(b->right, b->op == BinaryOp::add ? factor : negate(factor), terms);
  }
  terms.push_back(binary(BinaryOp::multiply, factor, e, e->origin));
}

}  // namespace

namespace formulas {

const ast::Argument* wall_of(const ast::Call& e) {
  for (const ast::Argument& argument : e.arguments) {
    if (argument.name == "at") return &argument;
  }
  return nullptr;
}

/// integral(e, at = y.low), mean(e, at = y.low)
TypedExpr wall_reduction(FormulaScope& here, Reduce::Kind kind, const ast::Call& e, SourceRange range) {
  const ast::Argument& at = *wall_of(e);
  const bool is_known = kind == Reduce::Kind::integral || kind == Reduce::Kind::mean;
  if (here.context != FormulaContext::quantity || !is_known || e.arguments.size() != 2 ||
      !e.arguments[0].name.empty()) {
    here.elaboration.sink.report("not-allowed-here", at.value.range(), {"a wall", "this reduction"},
                                 "in observables, losses and tests write integral(dy(T), at = y.low), or mean of it");
    return {};
  }
  if (is_refused_in_curves(here.elaboration, "a reduction over a wall", range)) return {};
  const auto* name = std::get_if<ast::Name>(&at.value->kind);
  const std::vector<std::string> walls = wall_names(here.elaboration.problem);
  const auto found = std::ranges::find(walls, name ? name->name : "");
  if (found == walls.end()) {
    here.elaboration.sink.report(
        "no-wall", at.value.range(), {name ? name->name : "this"},
        walls.empty() ? "all axes are periodic" : fmt::format("walls here: {}", fmt::join(walls, ", ")));
    return {};
  }
  const SourceRange inside = e.arguments[0].value.range();
  const auto operand = as_number(here, any(here, e.arguments[0].value), inside);
  if (!operand) return {};
  const Wall wall{axis_of(found->substr(0, 1)), found->ends_with(".low")};
  OnWall on_wall(here.elaboration, wall);
  std::vector<Expr> terms;
  add_terms(*operand, 1.0, terms);
  const Axis& axis = here.elaboration.problem.axes[static_cast<std::size_t>(wall.axis)];
  const Expr place = coordinate(wall.axis);
  const double reach = axis.holds_wall(wall.is_low) ? 0.75 : 1.25;
  const Expr beside = wall.is_low ? binary(BinaryOp::less, place, place_after(axis, wall.axis, reach))
                                  : binary(BinaryOp::greater, place, place_before(axis, wall.axis, reach));
  double area = 1;
  for (const Axis& other : here.elaboration.problem.axes) area *= &other == &axis ? 1 : other.high - other.low;
  Expr sum = 0.0;
  for (const Expr& term : terms) {
    const auto value = on_wall.term(term);
    if (!value) {
      const SourceRange part = on_wall.mistake.range;
      here.elaboration.sink.report("not-known-on-wall", part.is_known() ? part : inside, {*found},
                                   "known there are fields, their first derivatives, coordinates and functions of "
                                   "these; of p, which a constraint gives, by itself");
      return {};
    }
    const Expr share = binary(BinaryOp::divide, *value, param("h" + axis.name));
    sum = binary(BinaryOp::add, sum, reduce(Reduce::Kind::integral, select(beside, share, 0.0), {range}), {range});
  }
  if (kind == Reduce::Kind::mean) sum = binary(BinaryOp::divide, sum, area, {range});
  return {TypedExpr::Type::number, {sum}};
}

}  // namespace formulas

}  // namespace dpde::model
