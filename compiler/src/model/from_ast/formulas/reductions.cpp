// SPDX-License-Identifier: Apache-2.0
// mean(u), mean(u, y), max(u, over = (x, y)): reductions over all axes of the scene, or over those named.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/scene/coordinates.h"

namespace dpde::model {

namespace {

using Around = std::function<Expr(const Expr&)>;

/// The terms of a sum, each with the factors `around` the sum, if they have different placements, as those of dot(u, u)
/// for a vector on faces; false if a term has none.
bool split_by_place(const Placements& placements, const Expr& e, const Around& around, std::vector<Expr>& terms) {
  if (!placements.find_mistake(e)) {
    terms.push_back(around(e));
    return !placements.find_mistake(terms.back());
  }
  if (const auto* neg = as<Neg>(e))
    return split_by_place(
        placements, neg->operand, [&](const Expr& part) { return around(negate(part, e->origin)); }, terms);
  const auto* b = as<Binary>(e);
  if (!b) return false;
  const auto is_everywhere = [&](const Expr& part) {
    return !placements.natural(part) && !placements.find_mistake(part);
  };
  if (b->op == BinaryOp::add || b->op == BinaryOp::subtract) {
    const Around right = [&](const Expr& part) {
      return around(b->op == BinaryOp::add ? part : negate(part, e->origin));
    };
    return split_by_place(placements, b->left, around, terms) && split_by_place(placements, b->right, right, terms);
  }
  const bool in_left = (b->op == BinaryOp::multiply || b->op == BinaryOp::divide) && is_everywhere(b->right);
  const bool in_right = b->op == BinaryOp::multiply && is_everywhere(b->left);
  if (!in_left && !in_right) return false;
  const Around scaled = [&](const Expr& part) {
    return around(in_left ? binary(b->op, part, b->right, e->origin) : binary(b->op, b->left, part, e->origin));
  };
  return split_by_place(placements, in_left ? b->left : b->right, scaled, terms);
}

bool is_linear(Reduce::Kind kind) { return kind != Reduce::Kind::max && kind != Reduce::Kind::min; }

/// A mean, sum or integral of a sum becomes the sum over its terms, each over the points of its placement.
std::vector<Expr> terms_by_place(const Problem& problem, Reduce::Kind kind, const Expr& operand) {
  const Placements placements(problem);
  if (!is_linear(kind) || !placements.is_staggered() || !placements.find_mistake(operand)) return {operand};
  std::vector<Expr> terms;
  const bool fits = split_by_place(
      placements, operand, [](const Expr& part) { return part; }, terms);
  return fits ? terms : std::vector{operand};  // misfits are reported later
}

}  // namespace

namespace formulas {

namespace {

bool add_axis(FormulaScope& here, const ast::Expr& e, std::array<bool, 3>& over);

/// Products of a dot keep their own placements if each is a separate term; otherwise, as in h*dot(u, u), they are at
/// the centres.
std::vector<Expr> terms_of_reduction(FormulaScope& here, Reduce::Kind kind, const ast::Expr& operand) {
  const Placements placements(here.elaboration.problem);
  const auto is_misplaced = [&](const Expr& term) { return placements.find_mistake(term).has_value(); };
  const bool was_in_sum = std::exchange(here.is_in_sum, is_linear(kind) && placements.is_staggered());
  auto value = as_number(here, any(here, operand), operand.range());
  std::vector<Expr> terms = value ? terms_by_place(here.elaboration.problem, kind, *value) : std::vector<Expr>{};
  if (std::exchange(here.is_in_sum, false) && std::ranges::any_of(terms, is_misplaced)) {
    value = as_number(here, any(here, operand), operand.range());
    terms = value ? terms_by_place(here.elaboration.problem, kind, *value) : std::vector<Expr>{};
  }
  here.is_in_sum = was_in_sum;
  return terms;
}

std::optional<std::array<bool, 3>> axes_of_reduction(FormulaScope& here, const ast::Call& e) {
  constexpr std::array all{true, true, true};
  if (e.arguments.size() == 1) return all;
  std::array<bool, 3> over{};
  for (std::size_t i = 1; i < e.arguments.size(); ++i) {
    const ast::Argument& argument = e.arguments[i];
    const bool is_alone = argument.name == "over" && e.arguments.size() == 2;
    if (!is_alone && !argument.name.empty()) {
      here.elaboration.sink.report("wrong-argument-count", argument.value.range(),
                                   {e.callee, "a formula and axes", "an argument called " + argument.name},
                                   "write " + e.callee + "(u, over = y)");
      return std::nullopt;
    }
    const auto* several = is_alone ? std::get_if<ast::Tuple>(&argument.value->kind) : nullptr;
    const bool fine = several ? std::all_of(several->elements.begin(), several->elements.end(),
                                            [&](const ast::Expr& axis) { return add_axis(here, axis, over); })
                              : add_axis(here, argument.value, over);
    if (!fine) return std::nullopt;
  }
  const bool is_all = std::all_of(over.begin(), over.begin() + here.axis_count(), [](bool along) { return along; });
  return is_all ? all : over;
}

bool add_axis(FormulaScope& here, const ast::Expr& e, std::array<bool, 3>& over) {
  const auto* name = std::get_if<ast::Name>(&e->kind);
  const int axis = name ? axis_of(here.elaboration, name->name) : -1;
  if (axis < 0) {
    here.elaboration.sink.report("unknown-axis", e.range(), {name ? name->name : "this"},
                                 "write mean(u, y) or max(u, over = y)");
    return false;
  }
  if (!has_axis(here, axis, e.range())) return false;
  bool& along = over[static_cast<std::size_t>(axis)];
  if (along) here.elaboration.sink.report("duplicate", e.range(), {"axis " + axis_name(axis)});
  return !std::exchange(along, true);
}

/// mean, sum, integral, and max and min with one argument: over space.
std::optional<Reduce::Kind> reduction_called(const ast::Call& e) {
  if (e.callee == "mean") return Reduce::Kind::mean;
  if (e.callee == "sum") return Reduce::Kind::sum;
  if (e.callee == "integral") return Reduce::Kind::integral;
  const bool is_over_space = e.arguments.size() == 1 || (e.arguments.size() == 2 && e.arguments[1].name == "over");
  if (e.callee == "max" && is_over_space) return Reduce::Kind::max;
  if (e.callee == "min" && is_over_space) return Reduce::Kind::min;
  return std::nullopt;
}

}  // namespace

TypedExpr reduction(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const Reduce::Kind kind = *reduction_called(e);
  if (here.context != FormulaContext::quantity && !here.is_of_step())
    return refuse(here, "the reduction " + e.callee, e.callee_range);
  if (wall_of(e) != nullptr) return wall_reduction(here, kind, e, range);
  const bool has_operand = !e.arguments.empty() && e.arguments[0].name.empty();
  if (!has_operand) {
    takes(here, e, 1);
    return {};
  }
  const SourceRange inside = e.arguments[0].value.range();
  const std::vector<Expr> terms = terms_of_reduction(here, kind, e.arguments[0].value);
  const auto over = axes_of_reduction(here, e);
  if (terms.empty() || !over || is_too_large(here, {TypedExpr::Type::number, terms}, inside)) return {};
  const Coordinates coordinates(here.elaboration.problem, {range});
  std::optional<Expr> sum;
  for (const Expr& term : terms) {
    const Expr part = coordinates.reduction(Reduce{kind, term, *over});
    sum = sum ? binary(BinaryOp::add, *sum, part, {range}) : part;
  }
  return number_of(*sum);
}

TypedExpr extreme(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (reduction_called(e)) return reduction(here, e, range);
  const bool is_over_axes = std::ranges::any_of(e.arguments, [](const ast::Argument& a) { return a.name == "over"; });
  if (e.arguments.size() == 2 && !is_over_axes) return elementary(here, e, range);
  here.elaboration.sink.report(
      "wrong-argument-count", e.callee_range,
      {e.callee, "2 numbers, or one field over space", counted(static_cast<int>(e.arguments.size()), "argument")},
      fmt::format("write {0}({0}(a, b), c) for more numbers, {0}({0}(a, b), over = x) over an axis", e.callee));
  return {};
}

TypedExpr integral(FormulaScope& here, const ast::Call& e, SourceRange range) {
  return is_quadrature(e) ? quadrature(here, e, range) : reduction(here, e, range);
}

}  // namespace formulas

}  // namespace dpde::model
