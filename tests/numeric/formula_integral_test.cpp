// SPDX-License-Identifier: Apache-2.0
// integral(f(s), s, from = a, to = b) against known values, for each kind of formula, and its derivatives.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_run.h"

namespace dpde::testing {
namespace {

constexpr int cells = 8;

double x_of(std::size_t i) { return -1 + 3 * (static_cast<double>(i) + 0.5) / cells; }

std::string scene(const std::string& initial, const std::string& rate = "0") {
  return "function bell(x, k) = exp(-k*x^2)\nmodel m { field u; param k; dt(u) = " + rate +
         " }\nscheme plain { time = rk4 }\nscene s : m with plain {\n  grid x = -1 .. 2, cells 8, periodic\n  k = 2\n" +
         "  initial u = " + initial + "\n  time 0 .. 1, step 1/4\n}\n";
}

void expect_state(const std::string& text, double (*exact)(double)) {
  const std::vector<double> u = run_scene(text, "s").state.at("u");
  ASSERT_EQ(u.size(), static_cast<std::size_t>(cells));
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(u[i], exact(x_of(i)), 1e-14) << x_of(i);
}

TEST(FormulaIntegral, OfAnInitialState) {
  expect_state(scene("integral(exp(-s^2), s, from = 0, to = x)"),
               [](double x) { return std::sqrt(std::acos(-1.0)) / 2 * std::erf(x); });
  expect_state(scene("integral(bell(s, k), s, from = x, to = 1)"), [](double x) {
    const double r = std::sqrt(2.0);
    return std::sqrt(std::acos(-1.0)) / (2 * r) * (std::erf(r) - std::erf(r * x));
  });
}

/// The integration variable hides the coordinate in the integral, and is not visible in bodies of functions.
TEST(FormulaIntegral, NamesWithinIt) {
  expect_state(scene("x + integral(3*x^2, x, from = 0, to = x)"), [](double x) { return x + x * x * x; });
  expect_state(scene("integral(4*s^3*bell(0*s, s), s, from = 0, to = x)"), [](double x) { return std::pow(x, 4); });
}

TEST(FormulaIntegral, InAnEquation) {
  expect_state(scene("x", "integral(2*s, s, from = 0, to = t)*x"), [](double x) { return x * 4 / 3; });
}

/// d/dk of the integral of exp(k*s) from 0 to k, at k = 2: exp(k^2) from the limit, plus the integral of s*exp(k*s).
TEST(FormulaIntegral, HasDerivativesByParameters) {
  const std::string task = "task t : s { unknown k; minimise mean(u) }\n";
  const TaskResult result = task_gradient(scene("integral(exp(k*s), s, from = 0, to = k)") + task, "t");
  EXPECT_NEAR(result.loss, (std::exp(4.0) - 1) / 2, 1e-13);
  const double inside = (4 * std::exp(4.0) - std::exp(4.0) + 1) / 4;
  EXPECT_NEAR(result.gradient.at("k").front(), std::exp(4.0) + inside, 1e-12);
}

}  // namespace
}  // namespace dpde::testing
