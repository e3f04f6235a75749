// SPDX-License-Identifier: Apache-2.0
// The table of derivatives, as formulas of models (slopes) and of kernels (tangents, adjoints) have it: each function
// and operator, each argument, against differences of its values; at kinks both have the same element.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "adjoint/rules.h"
#include "model/analyse/formula.h"
#include "model/build.h"
#include "stencil/build.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde {
namespace {

using Point = std::array<double, 2>;

/// f(a, b) at both levels, and its value; functions of one argument do not look at b.
struct Function {
  std::string name;
  model::Expr of_model;
  stencil::Expr of_kernel;
};

Function rule_of(Fn fn) {
  std::vector<model::Expr> coordinates{model::coordinate(0)};
  std::vector<stencil::Expr> params{stencil::param("a")};
  if (arity(fn) == 2) coordinates.push_back(model::coordinate(1)), params.push_back(stencil::param("b"));
  return {std::string(name_of(fn)), model::call(fn, coordinates), stencil::call(fn, params)};
}

Function rule_of(BinaryOp op) {
  return {std::string(spelling(op)), model::binary(op, model::coordinate(0), model::coordinate(1)),
          stencil::binary(op, stencil::param("a"), stencil::param("b"))};
}

double value_of(const stencil::Expr& e, const Point& at) {
  const auto value = [&](const stencil::Expr& part) { return value_of(part, at); };
  return match(
      e->kind, [](const Literal& l) { return l.value; },
      [&](const stencil::Param& p) { return p.name == "a" ? at[0] : at[1]; },
      [&](const stencil::Neg& n) { return -value(n.operand); },
      [&](const stencil::Binary& b) { return evaluate_binary(b.op, value(b.left), value(b.right)); },
      [&](const stencil::Call& c) { return evaluate_call_of(c.fn, c.arguments, value); },
      [&](const stencil::Select& s) { return value(value(s.condition) != 0 ? s.yes : s.no); },
      [](const OneOf<stencil::Local, stencil::Access, stencil::Interp, stencil::Inside> auto&) { return NAN; });
}
double value_of(const model::Expr& e, const Point& at) { return model::value_at(e, {at[0], at[1], 0}); }

model::Expr slope_along(const model::Expr& e, int by) { return model::slope_of(e, {.axis = by}); }
double slope_of_model(const Function& f, int by, const Point& at) { return value_of(slope_along(f.of_model, by), at); }
double slope_of_kernel(const Function& f, int by, const Point& at) {
  return value_of(adjoint::times_partial(f.of_kernel, by, 1.0), at);
}

/// Error of order h^4: (8 (f(x + h) - f(x - h)) - (f(x + 2h) - f(x - 2h)))/(12 h).
double difference(const Function& f, int by, const Point& at) {
  const double h = 1e-3;
  const auto moved = [&](double way) {
    Point to = at;
    to[static_cast<std::size_t>(by)] += way * h;
    return value_of(f.of_kernel, to);
  };
  return (8 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12 * h);
}

void expect_slopes(const Function& f, int arguments, const std::vector<Point>& points) {
  for (const Point& at : points) {
    EXPECT_DOUBLE_EQ(value_of(f.of_model, at), value_of(f.of_kernel, at)) << f.name;
    for (int by = 0; by < arguments; ++by) {
      const double expected = difference(f, by, at), size = std::max(1.0, std::abs(expected));
      EXPECT_NEAR(slope_of_model(f, by, at), expected, 1e-8 * size) << f.name << " by " << by << " at " << at[0];
      EXPECT_NEAR(slope_of_kernel(f, by, at), expected, 1e-8 * size) << f.name << " by " << by << " at " << at[0];
    }
  }
}

TEST(DerivativeTable, FitsDifferencesOfFunctions) {
  const std::vector<Point> anywhere{{0.3, 0}, {-0.7, 0}, {0.9, 0}}, positive{{0.3, 0}, {0.7, 0}, {2.5, 0}},
      pairs{{0.3, 0.7}, {0.7, 0.3}, {-1.2, 0.4}};
  for (const Fn fn : every_function()) {
    const bool is_of_positive = fn == Fn::log || fn == Fn::sqrt;
    expect_slopes(rule_of(fn), arity(fn), arity(fn) == 2 ? pairs : is_of_positive ? positive : anywhere);
  }
}

TEST(DerivativeTable, FitsDifferencesOfOperators) {
  for (int i = 0; i <= static_cast<int>(BinaryOp::power); ++i)
    expect_slopes(rule_of(static_cast<BinaryOp>(i)), 2, {{0.3, 0.7}, {1.7, -1.3}, {2.5, 3}});
  for (const double exponent : {2.0, 3.0, 0.5, -1.0, -2.5}) {
    const Function power{"power", model::binary(BinaryOp::power, model::coordinate(0), exponent),
                         stencil::power(stencil::param("a"), exponent)};
    expect_slopes(power, 1, {{0.3, 0}, {1.7, 0}});
  }
  for (int i = static_cast<int>(BinaryOp::less); i <= static_cast<int>(BinaryOp::logical_or); ++i)
    expect_slopes(rule_of(static_cast<BinaryOp>(i)), 2, {{0.3, 0.7}, {1.7, -1.3}});
}

/// An element of the generalised gradient, and the same one at both levels: that of max + min is that of a + b.
TEST(DerivativeTable, HasOneRuleAtKinks) {
  struct Row {
    Function f;
    Point at;
    std::vector<double> slopes;
  };
  const std::vector<Row> rows{{rule_of(Fn::max), {0.5, 0.5}, {1, 0}},    {rule_of(Fn::min), {0.5, 0.5}, {0, 1}},
                              {rule_of(Fn::max), {0.0, -0.0}, {1, 0}},   {rule_of(Fn::abs), {0, 0}, {0}},
                              {rule_of(Fn::sign), {0, 0}, {0}},          {rule_of(Fn::floor), {2, 0}, {0}},
                              {rule_of(Fn::fraction), {2, 0}, {1}},      {rule_of(BinaryOp::power), {0, 2}, {0, 0}},
                              {rule_of(BinaryOp::power), {0, 1}, {1, 0}}};
  for (const Row& row : rows) {
    for (std::size_t by = 0; by < row.slopes.size(); ++by) {
      EXPECT_EQ(slope_of_model(row.f, static_cast<int>(by), row.at), row.slopes[by]) << row.f.name << " by " << by;
      EXPECT_EQ(slope_of_kernel(row.f, static_cast<int>(by), row.at), row.slopes[by]) << row.f.name << " by " << by;
    }
  }
}

/// Derivatives are derived again. In kernels 1/cosh^2 would have 0*inf for a derivative far out.
TEST(DerivativeTable, StaysFiniteWhereTheFunctionIs) {
  const Function tanh = rule_of(Fn::tanh), over = rule_of(BinaryOp::divide);
  for (const double a : {-1e4, -800.0, 20.0, 800.0, 1e4}) {
    EXPECT_NEAR(slope_of_kernel(tanh, 0, {a, 0}), 0, 1e-15) << a;
    if (std::abs(a) > 100) continue;
    model::Expr derivative = tanh.of_model;
    for (int order = 1; order <= 4; ++order) {
      derivative = slope_along(derivative, 0);
      EXPECT_NEAR(value_of(derivative, {a, 0}), 0, 1e-15) << order << " at " << a;
    }
  }
  for (const auto& slope_at : {slope_of_model, slope_of_kernel})
    EXPECT_DOUBLE_EQ(slope_at(over, 1, {1e180, 1e200}), -1e-220);
}

/// Cells of a stretched axis are as long as such a slope.
TEST(DerivativeTable, HasTheDigitsOfTanhInFormulasOfModels) {
  for (const double a : {-18.0, 5.0, 15.0, 18.0})
    EXPECT_NEAR(slope_of_model(rule_of(Fn::tanh), 0, {a, 0}) * std::pow(std::cosh(a), 2), 1, 1e-14) << a;
}

/// 1 - a^2 has an error of a rounding of 1, (1 - a)*(1 + a) of one of itself.
TEST(DerivativeTable, HasTheDigitsOfArcSines) {
  const double below_1 = 1e-9, a = 1 - below_1;
  const double exact = 1 / std::sqrt((1 - a) * (2 - (1 - a)));  // 1 - a is exact
  for (const auto& slope_at : {slope_of_model, slope_of_kernel}) {
    EXPECT_NEAR(slope_at(rule_of(Fn::asin), 0, {a, 0}) / exact, 1, 1e-15);
    EXPECT_NEAR(slope_at(rule_of(Fn::acos), 0, {a, 0}) / exact, -1, 1e-15);
  }
}

}  // namespace
}  // namespace dpde
