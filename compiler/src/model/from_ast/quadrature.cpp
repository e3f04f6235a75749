// SPDX-License-Identifier: Apache-2.0
// integral(f(s), s, from = a, to = b): of a formula, by the 32 places of Gauss and Legendre, whose error is rounding
// for what is smooth. It is spelled out as a sum, so that it goes wherever a formula may, and derivatives follow.
#include <array>
#include <cmath>
#include <utility>

#include "model/build.h"
#include "model/from_ast/expressions.h"

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

}  // namespace

bool Expressions::is_quadrature(const ast::Call& e) {
  return e.callee == "integral" && e.arguments.size() > 1 && e.arguments.back().name == "to";
}

Typed Expressions::quadrature(const ast::Call& e, SourceRange range) {
  const bool has_form = e.arguments.size() == 4 && e.arguments[0].name.empty() && e.arguments[1].name.empty() &&
                        e.arguments[2].name == "from";
  const auto* variable = has_form ? std::get_if<ast::Name>(&e.arguments[1].value->kind) : nullptr;
  if (variable == nullptr) {
    draft_.sink.report("wrong-argument-count", e.callee_range,
                       {e.callee, "a formula, what runs in it, where from and where to", "this"},
                       "write integral(exp(-s^2), s, from = 0, to = x)");
    return {};
  }
  const auto low = as_number(any(e.arguments[2].value), e.arguments[2].value.range());
  const auto high = as_number(any(e.arguments[3].value), e.arguments[3].value.range());
  if (!low || !high) return {};
  const Expr half = binary(BinaryOp::multiply, 0.5, binary(BinaryOp::subtract, *high, *low, {range}), {range});
  const Expr middle = binary(BinaryOp::add, *low, half, {range});
  const std::map<std::string, Typed> outside = running_;
  std::optional<Expr> sum = 0.0;
  for (const QuadratureNode& node : gauss_nodes()) {
    const Expr place = binary(BinaryOp::add, middle, binary(BinaryOp::multiply, node.place, half, {range}), {range});
    running_[variable->name] = number_of(place);
    const auto value = as_number(any(e.arguments[0].value), e.arguments[0].value.range());
    if (!value) sum.reset();
    if (!sum) break;
    sum = binary(BinaryOp::add, *sum, binary(BinaryOp::multiply, node.weight, *value, {range}), {range});
  }
  running_ = outside;
  if (!sum) return {};
  Typed result = number_of(binary(BinaryOp::multiply, half, *sum, {range}));
  return is_too_large(result, range) ? Typed{} : result;
}

}  // namespace dpde::model
