// SPDX-License-Identifier: Apache-2.0
// integral(f(s), s, from = a, to = b): of a formula, by the 32 places of Gauss and Legendre, whose error is rounding
// for what is smooth. It is spelled out as a sum, so that it goes wherever a formula may, and derivatives follow.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "model/build.h"
#include "model/formula.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr int place_count = 32;

struct QuadratureNode {
  double place, weight;  // in -1 .. 1
};

/// Zeros of the Legendre polynomial, by Newton's iteration from their asymptotes.
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

/// nullopt where more than coordinates and parameters with values is in it.
std::optional<double> known_at(const Draft& draft, const Expr& e, const std::array<double, 3>& place) {
  const bool is_open = any_part(e, [&](const Expr& part) {
    const auto* param = std::get_if<Param>(&part->kind);
    const auto known = param != nullptr ? draft.values.find(param->name) : draft.values.end();
    return param != nullptr && (known == draft.values.end() || !known->second);
  });
  if (is_open) return std::nullopt;
  const Expr formula = with_values(draft, e);
  return is_formula(formula) ? std::optional(value_at(formula, place)) : std::nullopt;
}

}  // namespace

bool Expressions::is_quadrature(const ast::Call& e) {
  return e.callee == "integral" && std::ranges::any_of(e.arguments, [](const ast::Argument& argument) {
           return argument.name == "from" || argument.name == "to";
         });
}

/// The sum over the places; of the sizes of the formula's values where `of_sizes`.
std::optional<Expr> Expressions::gauss_sum(const ast::Call& e, const Expr& low, const Expr& high, bool of_sizes) {
  const std::string& variable = std::get<ast::Name>(e.arguments[1].value->kind).name;
  const Origin origin{e.callee_range};
  const Expr half = binary(BinaryOp::multiply, 0.5, binary(BinaryOp::subtract, high, low, origin), origin);
  const Expr middle = binary(BinaryOp::add, low, half, origin);
  const std::map<std::string, Typed> outside = running_;
  std::optional<Expr> sum = 0.0;
  for (const QuadratureNode& node : gauss_nodes()) {
    const Expr place = binary(BinaryOp::add, middle, binary(BinaryOp::multiply, node.place, half, origin), origin);
    running_[variable] = number_of(place);
    std::optional<Expr> value = as_number(any(e.arguments[0].value), e.arguments[0].value.range());
    if (value && of_sizes) value = model::call(Fn::abs, {*value}, origin);
    if (!value) sum.reset();
    if (!sum) break;
    sum = binary(BinaryOp::add, *sum, binary(BinaryOp::multiply, node.weight, *value, origin), origin);
  }
  running_ = outside;
  return sum ? std::optional(binary(BinaryOp::multiply, half, *sum, origin)) : std::nullopt;
}

/// Where all of it is known, at the ends of the grid, the same in two parts tells whether the places do.
void Expressions::look_at_parts(const ast::Call& e, const Expr& low, const Expr& high, const Expr& whole) {
  constexpr double digits = 1e-6;
  constexpr double share = 0.382;  // not in the middle, about which a formula may be odd
  const Expr middle =
      binary(BinaryOp::add, binary(BinaryOp::multiply, 1 - share, low), binary(BinaryOp::multiply, share, high));
  const auto first = gauss_sum(e, low, middle, false), second = gauss_sum(e, middle, high, false),
             sizes = gauss_sum(e, low, high, true);
  if (!first || !second || !sizes) return;
  for (const bool is_low : {true, false}) {
    std::array<double, 3> corner{};
    for (std::size_t a = 0; a < draft_.problem.axes.size(); ++a)
      corner[a] = is_low ? draft_.problem.axes[a].low : draft_.problem.axes[a].high;
    const auto at_once = known_at(draft_, whole, corner);
    const auto parts = known_at(draft_, binary(BinaryOp::add, *first, *second), corner);
    const auto size = known_at(draft_, *sizes, corner);
    if (!at_once || !parts || !size || std::abs(*at_once - *parts) <= digits * std::abs(*size)) continue;
    draft_.sink.report(
        "integral-not-resolved", e.callee_range, {fmt::format("{:.6g}", *at_once), fmt::format("{:.6g}", *parts)},
        "split it where the formula has a kink, a jump or a narrow peak: integral(f, s, from = a, to = c) "
        "+ integral(f, s, from = c, to = b)");
    return;
  }
}

Typed Expressions::quadrature(const ast::Call& e, SourceRange range) {
  const bool has_form = e.arguments.size() == 4 && e.arguments[0].name.empty() && e.arguments[1].name.empty() &&
                        e.arguments[2].name == "from" && e.arguments[3].name == "to";
  if (!has_form || std::get_if<ast::Name>(&e.arguments[1].value->kind) == nullptr) {
    draft_.sink.report("wrong-argument-count", e.callee_range,
                       {e.callee, "a formula, what runs in it, where from and where to", "this"},
                       "write integral(exp(-s^2), s, from = 0, to = x)");
    return {};
  }
  const auto low = as_number(any(e.arguments[2].value), e.arguments[2].value.range());
  const auto high = as_number(any(e.arguments[3].value), e.arguments[3].value.range());
  if (!low || !high) return {};
  const std::optional<Expr> sum = gauss_sum(e, *low, *high, false);
  if (!sum) return {};
  Typed result = number_of(*sum);
  if (is_too_large(result, range)) return {};
  if (running_.empty()) look_at_parts(e, *low, *high, *sum);
  return result;
}

}  // namespace dpde::model
