// SPDX-License-Identifier: Apache-2.0
// The order that an operator states against the one it has. References: orders of published formulas.
#include "stencil/space/operator_order.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "model/from_ast.h"
#include "stencil/analyse/laurent.h"
#include "stencil/lower/from_model.h"
#include "syntax/parser.h"

namespace dpde::stencil {
namespace {

struct Outcome {
  std::string complaints;  // "E0557 has at `name`: message", a line each
  std::vector<MeasuredOrder> measured;
};

/// One equation dt(u) = rhs on `axes` axes, of u, a coefficient c and parameters k = 1/3, one = 1.
Outcome outcome_of(const std::string& operators, const std::string& rhs, int axes = 1, const std::string& more = "",
                   const std::string& scheme = "") {
  std::string text = operators + "\nmodel m { field u; coefficient c; param k, one; dt(u) = " + rhs +
                     " + 0*c*k*one*u }\nscheme q { time = rk2; " + scheme + " }\nscene s : m with q {\n";
  const char* const grids[] = {"grid x = 0 .. 2, cells 8, periodic", "grid y = -1 .. 2, cells 8, periodic",
                               "grid z = 0 .. 1, cells 8, periodic"};
  for (int axis = 0; axis < axes; ++axis) text += std::string("  ") + grids[axis] + (axis == 0 ? more : "") + "\n";
  text += "  k = 1/3\n  one = 1\n  c = 2 + sin(pi*x)\n  initial u = x\n  time 0 .. 1, step 1/4\n}\n";
  const SourceFile source("m.dpde", text);
  DiagnosticSink sink;
  const ast::File file = ast::parse(source, sink);
  const auto problem = model::from_ast(file, {}, sink);
  Outcome outcome;
  if (problem) from_model(*problem, program_names(*problem), sink);
  for (const Diagnostic& d : sink.all()) {
    outcome.complaints +=
        fmt::format("{} at {}: {}\n", d.kind->code,
                    d.range.is_known() ? text.substr(d.range.begin, d.range.end - d.range.begin) : "", d.message);
    if (d.kind->code == "E0557" || d.kind->code == "W0501") {
      EXPECT_FALSE(d.hint.empty());
    }
  }
  if (!problem) return outcome;
  for (const model::StatedOrder& stated : problem->operators)
    outcome.measured.push_back(measure_order(*problem, stated));
  return outcome;
}

/// Of the only operator, f, that is used.
int found(const std::string& definition, const std::string& rhs, int axes = 1, const std::string& scheme = "") {
  const Outcome outcome = outcome_of(definition, rhs, axes, "", scheme);
  EXPECT_EQ(outcome.complaints, "") << definition;
  if (outcome.measured.size() != 1) return -100;
  const MeasuredOrder& m = outcome.measured[0];
  EXPECT_EQ(m.why, "") << definition;
  return m.kind == MeasuredOrder::Kind::found ? m.order : m.kind == MeasuredOrder::Kind::exact ? 100 : -m.order;
}

TEST(OperatorOrder, OfPublishedFormulas) {
  EXPECT_EQ(found("operator f(u) order 1 = (u - u[-1])/hx", "f(u)"), 1);
  EXPECT_EQ(found("operator f(u) order 2 = (u[+1] - u[-1])/(2*hx)", "f(u)"), 2);
  EXPECT_EQ(found("operator f(u) order 4 = (u[-2] - 8*u[-1] + 8*u[+1] - u[+2])/(12*hx)", "f(u)"), 4);
  EXPECT_EQ(found("operator f(u) order 6 = (2*u[-3] - 27*u[-2] + 270*u[-1] - 490*u + 270*u[+1] - 27*u[+2] + "
                  "2*u[+3])/(180*hx^2)",
                  "f(u)"),
            6);
  EXPECT_EQ(found("operator f(u) order 8 = 4/5*(u[+1] - u[-1])/hx - 1/5*(u[+2] - u[-2])/hx + 4/105*(u[+3] - u[-3])/hx "
                  "- 1/280*(u[+4] - u[-4])/hx",
                  "f(u)"),
            8);
  EXPECT_EQ(found("operator f(u) order 2 = (u[+2] - 2*u[+1] + 2*u[-1] - u[-2])/(2*hx^3)", "f(u)"), 2);
  EXPECT_EQ(found("operator f(u) order 2 = (u[+1] + u[-1])/2", "f(u)"), 2);
  EXPECT_EQ(found("operator f(u) order 7 = u^2 + sin(u)", "f(u)"), 100);
  EXPECT_EQ(found("operator f(u) order 2 = (u[+1, 0, 0] - 2*u + u[-1, 0, 0])/hx^2 + (u[0, +1, 0] - 2*u + u[0, -1, "
                  "0])/hy^2 + (u[0, 0, +1] - u[0, 0, -1])/(2*hz)",
                  "f(u)", 3),
            2);
  EXPECT_EQ(found("operator f(u) order 1 = (u[+1, 0] - 2*u + u[-1, 0])/hx^2 + (u[0, +1] - u)/hy", "f(u)", 2), 1);
}

TEST(OperatorOrder, OfNonlinearOperatorsAndOfCoefficients) {
  EXPECT_EQ(found("operator f(u, c) order 2 = ((c[+1] + c)*(u[+1] - u) - (c + c[-1])*(u - u[-1]))/(2*hx^2)", "f(u, c)"),
            2);
  EXPECT_EQ(found("operator f(u, c) order 1 = (c[+1]*(u[+1] - u) - c*(u - u[-1]))/hx^2", "f(u, c)"), 1);
  EXPECT_EQ(found("operator f(u) order 2 = (u[+1]^2 - u[-1]^2)/(4*hx)", "f(u)"), 2);
  EXPECT_EQ(found("operator f(v, u) order 1 = max(v, 0)*(u - u[-1])/hx + min(v, 0)*(u[+1] - u)/hx", "f(u, u)"), 1);
  EXPECT_EQ(found("operator f(u) order 1 = if(u > 0, (u - u[-1])/hx, (u[+1] - u)/hx)", "f(u)"), 1);
  // the mean of the slopes of both sides where they have one sign: of order 2 away from extrema
  EXPECT_EQ(
      found(
          "operator f(u) order 2 = if((u[+1] - u)*(u - u[-1]) > 0, 2*(u[+1] - u)*(u - u[-1])/((u[+1] - u[-1])*hx), 0)",
          "f(u)"),
      2);
  EXPECT_EQ(found("operator f(u) order 1 = log(exp(u[+1]) + 1) - 2*sqrt(1 + u^2) + tanh(u[-1]) + "
                  "atan(u)*sinh(u)/cosh(u[+1] + u[-1] - 2*u)",
                  "f(u)"),
            1);
}

TEST(OperatorOrder, OfWhatItIsGiven) {
  const std::string muscl =
      "operator f(u, k) order 3 = (u - u[-1] + (1 - k)/4*(u - 2*u[-1] + u[-2]) + (1 + k)/4*(u[+1] - 2*u + u[-1]))/hx";
  EXPECT_EQ(found(muscl, "f(u, k)"), 3);  // the third-order member, k = 1/3
  const Outcome other = outcome_of(muscl, "f(u, 0.5*one)");
  EXPECT_EQ(other.complaints, "E0557 at f: operator f is stated to be of order 3, but its error goes as h^2\n");
  EXPECT_EQ(found("operator f(u) order 2 = dx(u)*u", "f(u)"), 2);
  EXPECT_EQ(found("operator f(u) order 4 = dx(u)*u + lap(u)", "f(u)", 1, "dx = central(4); lap = central(4)"), 4);
  EXPECT_EQ(found("operator f(v) order 2 = (v.x[+1, 0] - v.x[-1, 0])/(2*hx) + (v.y[0, +1] - v.y[0, -1])/(2*hy)",
                  "f((u, c))", 2),
            2);
}

TEST(OperatorOrder, MoreThanStatedIsAWarning) {
  EXPECT_EQ(outcome_of("operator slope(u) order 1 = (u[+1] - u[-1])/(2*hx)", "slope(u)").complaints,
            "W0501 at slope: operator slope is stated to be of order 1, but has order 2\n");
  EXPECT_EQ(outcome_of("operator theta(u, k) order 1 = (k*(u[+1] - u) + (1 - k)*(u - u[-1]))/hx",
                       "theta(u, 3/2*k) + theta(u, k)")
                .complaints,
            "");
  EXPECT_EQ(outcome_of("operator any(u) order 0 = (u[+1] - 2*u[-1] + u)/hx^2", "any(u)").complaints, "");
}

TEST(OperatorOrder, WhatIsNotMeasuredSaysWhy) {
  const auto why = [](const std::string& definition, const std::string& rhs) {
    const Outcome outcome = outcome_of(definition, rhs);
    EXPECT_EQ(outcome.complaints, "");
    return outcome.measured.empty() ? "" : outcome.measured[0].why;
  };
  EXPECT_EQ(why("operator f(u) order 2 = (u[+1] - mean(u))/hx", "f(u)"), "it holds a reduction");
  EXPECT_EQ(why("operator f(u) order 2 = log(-u^2 - 1)*(u[+1] - u)", "f(u)"),
            "it has no smooth value for the fields that were tried");
  EXPECT_EQ(why("operator f(u) order 2 = sqrt(u[+1] - u)", "f(u)"),
            "it has no smooth value for the fields that were tried");
}

/// On a stretched axis neighbours are those of the uniform coordinate.
TEST(OperatorOrder, OnAStretchedAxis) {
  const Outcome outcome =
      outcome_of("operator f(u) order 2 = u[+1] - 2*u + u[-1] + dx(u)", "f(u)", 1, ", stretched x + 0.1*sin(pi*x)");
  EXPECT_EQ(outcome.complaints, "");
  ASSERT_EQ(outcome.measured.size(), 1u);
  EXPECT_EQ(outcome.measured[0].order, 2);
}

// ---- series --------------------------------------------------------------------------------------------------------

double coefficient(const Laurent& s, int power) {
  return power < s.low ? 0 : s.terms.at(static_cast<std::size_t>(power - s.low)).value;
}

TEST(Laurent, FunctionsHaveTheirTaylorCoefficients) {
  const Laurent h = monomial(1, 1), one = monomial(1);
  EXPECT_NEAR(coefficient(call(Fn::exp, {h}), 5), 1.0 / 120, 1e-16);
  EXPECT_NEAR(coefficient(call(Fn::log, {one + h}), 4), -0.25, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::sin, {h}), 7), -1.0 / 5040, 1e-16);
  EXPECT_NEAR(coefficient(call(Fn::cos, {h}), 6), -1.0 / 720, 1e-16);
  EXPECT_NEAR(coefficient(call(Fn::tan, {h}), 5), 2.0 / 15, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::asin, {h}), 5), 3.0 / 40, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::acos, {h}), 3), -1.0 / 6, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::atan, {h}), 5), 1.0 / 5, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::sinh, {h}), 3), 1.0 / 6, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::cosh, {h}), 4), 1.0 / 24, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::tanh, {h}), 5), 2.0 / 15, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::erf, {h}), 3), -2 / (3 * std::sqrt(std::numbers::pi)), 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::sqrt, {one + h}), 3), 1.0 / 16, 1e-15);
  EXPECT_NEAR(coefficient(call(Fn::sqrt, {h * h * (one + h)}), 2), 0.5, 1e-15);
  EXPECT_NEAR(coefficient(power(one + h, monomial(-3)), 3), -10, 1e-13);
  EXPECT_NEAR(coefficient(power(monomial(2), h), 2), std::log(2) * std::log(2) / 2, 1e-15);
  EXPECT_NEAR(coefficient(one / (h * h - h), -1), -1, 1e-15);
  EXPECT_EQ(coefficient(call(Fn::abs, {-h}), 1), 1);
  EXPECT_EQ(coefficient(call(Fn::floor, {monomial(2) - h}), 0), 1);
  EXPECT_EQ(coefficient(call(Fn::fraction, {monomial(2.5) + h}), 0), 0.5);
  EXPECT_EQ(coefficient(call(Fn::min, {one, one - h}), 1), -1);
  EXPECT_EQ(coefficient(call(Fn::max, {one, one - h}), 1), 0);
  EXPECT_EQ(sign_of(h - h), 0);
}

TEST(Laurent, WhatHasNoSeriesIsNotKnown) {
  const Laurent h = monomial(1, 1), one = monomial(1);
  EXPECT_FALSE(call(Fn::log, {h}).is_known());
  EXPECT_FALSE(call(Fn::sqrt, {h}).is_known());
  EXPECT_FALSE(call(Fn::exp, {one / h}).is_known());
  EXPECT_FALSE(call(Fn::asin, {one}).is_known());
  EXPECT_FALSE((one / (h - h)).is_known());
  EXPECT_FALSE((one / h / h + no_series()).is_known());
  EXPECT_FALSE(call(Fn::max, {no_series(), one}).is_known());
}

}  // namespace
}  // namespace dpde::stencil
