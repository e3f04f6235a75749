// SPDX-License-Identifier: Apache-2.0
// integral(f(s), s, from = a, to = b) of a formula, by 32-point Gauss-Legendre quadrature, exact to rounding for smooth
// formulas. It is expanded to a sum, so it is allowed wherever formulas are, and derivatives follow.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

constexpr int place_count = 32;

struct QuadratureNode {
  double place, weight;  // in -1 .. 1
};

/// Zeros of the Legendre polynomial, by Newton's iteration from their asymptotic values.
std::array<QuadratureNode, place_count> gauss_nodes() {
  std::array<QuadratureNode, place_count> nodes{};
  for (int i = 0; i < place_count; ++i) {
    double x = std::cos(3.141592653589793 * (i + 0.75) / (place_count + 0.5)), slope = 1;
    for (int iteration = 0; iteration < 10; ++iteration) {
      double before = 1, value = x;
      for (int n = 2; n <= place_count; ++n)
        before = std::exchange(value, ((2 * n - 1) * x * value - (n - 1) * before) / n);
      slope = place_count * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    nodes[static_cast<std::size_t>(i)] = {x, 2 / ((1 - x * x) * slope * slope)};
  }
  return nodes;
}

/// Cell centres: two corners, and others spread by multiples of irrational numbers.
std::vector<std::array<double, 3>> places_to_look_at(const std::vector<Axis>& axes) {
  constexpr int between = 8;
  constexpr std::array steps{0.6180339887498949, 0.7548776662466927, 0.5698402909980532};
  std::vector<std::array<double, 3>> places(between + 2);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    for (int i = 0; i < between; ++i) {
      const double share = 0.5 + i * steps[a];
      const auto cell = static_cast<std::int64_t>((share - std::floor(share)) * axes[a].cells);
      places[static_cast<std::size_t>(i)][a] = axes[a].centre(cell);
    }
    places[between][a] = axes[a].centre(0);
    places[between + 1][a] = axes[a].centre(axes[a].cells - 1);
  }
  return places;
}

/// A field that is read at the point itself.
std::optional<std::string> field_in(const Expr& e) {
  std::optional<std::string> found;
  if (const auto* field = as<Field>(e)) return field->name;
  if (is<Reduce, Sample>(e)) return found;
  for_each_child(e, [&](const Expr& part) {
    if (!found) found = field_in(part);
  });
  return found;
}

/// Looks for a field that can be moved in front of an integral. Its author probably meant the field at the integration
/// point, but the field is constant in the integral. In exp(-s*u) or 1/(1 + s*u) a field cannot be moved, and is
/// allowed.
struct MovableField {
  using Found = std::optional<std::string>;
  Expr place;
  const std::vector<Expr>& integrals;  // expanded integrals within this one; their factors are not from the text

  bool holds_place(const Expr& e) const {
    return any_part(e, [&](const Expr& part) { return part == place; });
  }
  bool is_integral(const Expr& e) const {
    return std::ranges::any_of(integrals, [&](const Expr& one) { return &one.node() == &e.node(); });
  }
  Found in(const std::vector<Expr>& parts, bool of_sum) const {
    for (const Expr& part : parts) {
      if (Found found = in(part, of_sum)) return found;
    }
    return std::nullopt;
  }
  /// Terms inside a factor are not terms of the integral: there `of_sum` is false.
  Found in(const Expr& e, bool of_sum) const;
};

MovableField::Found MovableField::in(const Expr& e, bool of_sum) const {
  if (!holds_place(e)) return field_in(e);
  if (is_integral(e)) return std::nullopt;
  if (const auto* neg = as<Neg>(e)) return in(neg->operand, of_sum);
  if (const auto* derivative = as<Derivative>(e)) return in(derivative->operand, of_sum);
  if (const auto* select = as<Select>(e)) {
    const bool has_edge_by_field = holds_place(select->condition) && field_in(select->condition);
    return has_edge_by_field ? std::nullopt : in({select->yes, select->no}, of_sum);
  }
  const auto* b = as<Binary>(e);
  if (b == nullptr) return std::nullopt;
  const bool left = holds_place(b->left), right = holds_place(b->right);
  switch (b->op) {
    case BinaryOp::add:
    case BinaryOp::subtract: return of_sum ? in({b->left, b->right}, true) : std::nullopt;
    case BinaryOp::multiply: return in({b->left, b->right}, of_sum && !(left && right));
    case BinaryOp::divide:
      if (!right) return in({b->right, b->left}, of_sum);
      return in(b->left, false);
    case BinaryOp::power: return right ? std::nullopt : in(b->left, false);
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return std::nullopt;
  }
  unreachable("operator");
}

}  // namespace

namespace formulas {

namespace {

std::optional<Expr> sum_of_parts(FormulaScope& here, const ast::Call& e, const Expr& low, const Expr& high);

/// The variable at a place. It has the unit of both limits.
TypedExpr variable_at(FormulaScope& here, const ast::Call& e, const Expr& place) {
  return {TypedExpr::Type::number,
          {place},
          here.elaboration.measures.common({e.arguments[2].value, e.arguments[3].value}, "")};
}

/// False after a diagnostic. The test with a symbolic integration point holds for all points.
bool follows_place(FormulaScope& here, const ast::Call& e) {
  const std::string& variable = std::get<ast::Name>(e.arguments[1].value->kind).name;
  const Expr place = param("a place " + variable);  // not a name of the text
  const std::map<std::string, TypedExpr> outside = here.variables;
  here.variables[variable] = variable_at(here, e, place);
  const std::optional<Expr> value = as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  here.variables = outside;
  if (!value) return false;
  const std::optional<std::string> field = MovableField{place, here.integrals}.in(*value, true);
  if (!field) return true;
  const std::string elsewhere =
      here.context == FormulaContext::quantity
          ? fmt::format("its values along {} are sample({}, at = {})", variable, *field, variable)
          : fmt::format(
                "integral(f*{0}) over the grid weighs its values by what f is there, a solve by a Green's function",
                *field);
  here.elaboration.sink.report(
      "not-allowed-here", e.arguments[0].value.range(),
      {*field, fmt::format("an integral over {} as a factor or a term", variable)},
      fmt::format("it is the {1} of the point itself, wherever {0} is: put it in front of the integral; {2}", variable,
                  *field, elsewhere));
  return false;
}

/// The sum over the quadrature points; with `of_sizes` over the formula's absolute values.
std::optional<Expr> gauss_sum(FormulaScope& here, const ast::Call& e, const Expr& low, const Expr& high,
                              bool of_sizes) {
  const std::string& variable = std::get<ast::Name>(e.arguments[1].value->kind).name;
  const Origin origin{e.callee_range};
  const Expr half = binary(BinaryOp::multiply, 0.5, binary(BinaryOp::subtract, high, low, origin), origin);
  const Expr middle = binary(BinaryOp::add, low, half, origin);
  const std::map<std::string, TypedExpr> outside = here.variables;
  std::optional<Expr> sum = 0.0;
  for (const QuadratureNode& node : gauss_nodes()) {
    const Expr place = binary(BinaryOp::add, middle, binary(BinaryOp::multiply, node.place, half, origin), origin);
    here.variables[variable] = variable_at(here, e, place);
    std::optional<Expr> value = as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
    if (value && of_sizes) value = model::call(Fn::abs, {*value}, origin);
    if (!value) sum.reset();
    if (!sum) break;
    sum = binary(BinaryOp::add, *sum, binary(BinaryOp::multiply, node.weight, *value, origin), origin);
  }
  here.variables = outside;
  return sum ? std::optional(binary(BinaryOp::multiply, half, *sum, origin)) : std::nullopt;
}

/// Checks the number of quadrature points by computing the integral, and those inside it, in two parts: if all values
/// are known, at some positions and times.
void look_at_parts(FormulaScope& here, const ast::Call& e, const Expr& low, const Expr& high, const Expr& whole) {
  constexpr double digits = 1e-6;
  KnownValues known = here.elaboration.params.values;
  known["t"] = here.elaboration.problem.t_begin;
  if (!is_formula(with_known(whole, known))) return;
  here.is_in_parts = true;
  const auto parts = sum_of_parts(here, e, low, high);
  const auto sizes = gauss_sum(here, e, low, high, true);
  here.is_in_parts = false;
  if (!parts || !sizes) return;
  const Problem& problem = here.elaboration.problem;
  double largest = 0, worst = 0;
  std::pair<double, double> values_there;
  for (const double share : holds_time(whole) ? std::vector{0.0, 0.382, 1.0} : std::vector{0.0}) {
    known["t"] = problem.t_begin + share * problem.steps * problem.step;
    const Expr once = with_known(whole, known), twice = with_known(*parts, known), size = with_known(*sizes, known);
    if (!is_formula(twice) || !is_formula(size)) return;
    for (const std::array<double, 3>& place : places_to_look_at(problem.axes)) {
      const std::pair here{value_at(once, place), value_at(twice, place)};
      const double difference = std::abs(here.first - here.second);
      if (const double there = value_at(size, place); there > largest) largest = there;
      if (difference <= worst || std::isnan(worst)) continue;
      worst = difference;
      values_there = here;
    }
  }
  if (worst <= digits * largest) return;
  here.elaboration.sink.report(
      "integral-not-resolved", e.callee_range,
      {fmt::format("{:.6g}", dpde::shown(values_there.first)), fmt::format("{:.6g}", dpde::shown(values_there.second))},
      "split it where the formula has a kink, a jump or a narrow peak: integral(f, s, from = a, to = c) "
      "+ integral(f, s, from = c, to = b)");
}

std::optional<Expr> sum_of_parts(FormulaScope& here, const ast::Call& e, const Expr& low, const Expr& high) {
  constexpr double share = 0.382;  // not in the middle, about which a formula may be odd
  const Expr middle =
      binary(BinaryOp::add, binary(BinaryOp::multiply, 1 - share, low), binary(BinaryOp::multiply, share, high));
  const auto first = gauss_sum(here, e, low, middle, false), second = gauss_sum(here, e, middle, high, false);
  return first && second ? std::optional(binary(BinaryOp::add, *first, *second)) : std::nullopt;
}

}  // namespace

bool is_quadrature(const ast::Call& e) {
  return e.callee == "integral" && std::ranges::any_of(e.arguments, [](const ast::Argument& argument) {
           return argument.name == "from" || argument.name == "to";
         });
}

TypedExpr quadrature(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const bool has_form = e.arguments.size() == 4 && e.arguments[0].name.empty() && e.arguments[1].name.empty() &&
                        e.arguments[2].name == "from" && e.arguments[3].name == "to";
  if (!has_form || std::get_if<ast::Name>(&e.arguments[1].value->kind) == nullptr) {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range,
                                 {e.callee, "a formula, its variable, and the limits from and to", "this"},
                                 "write integral(exp(-s^2), s, from = 0, to = x)");
    return {};
  }
  const auto low = as_number(here, any(here, e.arguments[2].value), e.arguments[2].value.range());
  const auto high = as_number(here, any(here, e.arguments[3].value), e.arguments[3].value.range());
  if (!low || !high) return {};
  const std::optional<Expr> sum =
      here.is_in_parts ? sum_of_parts(here, e, *low, *high) : gauss_sum(here, e, *low, *high, false);
  if (!sum || (!here.is_in_parts && !follows_place(here, e))) return {};
  here.integrals.push_back(*sum);
  TypedExpr result = number_of(*sum);
  if (is_too_large(here, result, range)) return {};
  if (here.variables.empty() && !here.is_in_parts) look_at_parts(here, e, *low, *high, *sum);
  return result;
}

}  // namespace formulas

}  // namespace dpde::model
