// SPDX-License-Identifier: Apache-2.0
// Gradients of chaotic runs: growth of the adjoint compared with that of a perturbation, and remaining digits.
#include <cmath>

#include "command_support.h"

namespace dpde::testing {
namespace {

using GradientGrowth = Command;

/// E. N. Lorenz 1963: sigma 10, rho 28, beta 8/3. From a state on the attractor.
std::string lorenz(const std::string& end, const std::string& step = "0.01", const std::string& more = "") {
  return "model lorenz {\n  field a, b, c\n  param rho\n  dt(a) = 10*(b - a)\n  dt(b) = a*(rho - c) - b\n"
         "  dt(c) = a*b - 8/3*c\n}\nscheme k { time = rk4 }\nscene s : lorenz with k {\n  grid x = 0 .. 1, cells 1, "
         "periodic\n"
         "  rho = 28\n  initial a = -5.76\n  initial b = 2.27\n  initial c = 32.82\n  time 0 .. " +
         end + ", step " + step + "\n}\ntask t : s {\n  unknown rho from 28\n  minimise mean(c) at t = " + end + "\n" +
         more + "}\n";
}

/// Its largest Lyapunov exponent is 0.906 (J. C. Sprott, Chaos and Time-Series Analysis, 2003).
TEST_F(GradientGrowth, OfLorenzIsItsLyapunovExponent) {
  write("s.dpde", lorenz("300"));
  const Outcome gradient = dpde("gradient s.dpde t --json");
  ASSERT_EQ(gradient.status, 0) << gradient.err;
  const Json growth = gradient.json()["growth"];
  EXPECT_NEAR(growth["adjoint_rate"].get<double>(), 0.906, 0.0906) << growth;
  EXPECT_NEAR(growth["perturbation_rate"].get<double>(), 0.906, 0.0906) << growth;
  EXPECT_NEAR(growth["perturbation_rate_at_half_step"].get<double>(), 0.906, 0.0906) << growth;
}

/// At t = 40 the gradient is -2.6e8 or any other number; within the suggested time span it has three correct digits.
TEST_F(GradientGrowth, BeyondRoundingIsToldWithTheWindowThatWouldDo) {
  write("s.dpde", lorenz("40"));
  const Outcome gradient = dpde("gradient s.dpde t --json");
  ASSERT_EQ(gradient.status, 0) << gradient.err;
  EXPECT_EQ(gradient.codes(), std::vector<std::string>{"W0806"}) << gradient.err;
  EXPECT_NE(gradient.err.find("chaos of the equations, no fault of the scheme"), std::string::npos) << gradient.err;
  const double window = gradient.json()["growth"]["safe_window"];
  EXPECT_GT(window, 20);
  EXPECT_LT(window, 40);
  const Outcome optimised = dpde("optimize s.dpde t --iterations 1 --json");
  const std::vector<std::string> codes = optimised.codes();
  EXPECT_NE(std::find(codes.begin(), codes.end(), "W0806"), codes.end()) << optimised.err;
  write("short.dpde", lorenz("10"));
  const Outcome quiet = dpde("gradient short.dpde t --json");
  EXPECT_TRUE(quiet.codes().empty()) << quiet.err;
  EXPECT_EQ(quiet.json()["growth"]["lost"], false);
}

/// An unstable state at rest is left much faster than perturbations grow on the attractor (E. N. Lorenz 1996, F = 8, 40
/// cells): the time span follows the actual growth rates, not their mean.
TEST_F(GradientGrowth, WindowsFollowTheCourseOfTheRates) {
  write("s.dpde",
        "operator carried(u) order 0 = (u[+1] - u[-2])*u[-1]\n"
        "model l96 {\n  field u\n  param F\n  dt(u) = F - u + carried(u)\n}\nscheme k { time = rk4 }\n"
        "scene s : l96 with k {\n  grid x = 0 .. 40, cells 40, periodic\n  F = 8\n"
        "  initial u = 8 + 0.01*sin(2*pi*x/40)\n  time 0 .. 30, step 0.01\n}\n"
        "task t : s {\n  unknown F from 8\n  minimise mean(u^2)\n}\n");
  const double window = dpde("gradient s.dpde t --json").json()["growth"]["safe_window"];
  EXPECT_GT(window, 2);
  EXPECT_LT(window, 4);
  const auto gradient = [&](const std::string& force) {
    const Outcome run =
        dpde("gradient s.dpde t --json --no-certify --set end=" + std::to_string(0.01 * std::floor(100 * window)) +
             " --set F=" + force);
    return run.json()["gradient"]["F"]["value"].get<double>();
  };
  const double at_8 = gradient("8"), beside = gradient("8.000000000000004");
  EXPECT_LT(std::abs(beside / at_8 - 1), 1e-3);
}

/// From (1, 1, 1) states keep six digits until t = 40, but the gradient at most three: one rounding of rho changes it
/// by 0.2 %.
TEST_F(GradientGrowth, LosesItsDigitsBeforeTheStatesDo) {
  std::string text = lorenz("40", "1/200");
  for (const auto& [own, one] : {std::pair{"a = -5.76", "a = 1"}, {"b = 2.27", "b = 1"}, {"c = 32.82", "c = 1"}})
    text.replace(text.find(own), std::string(own).size(), one);
  write("s.dpde", text);
  const Outcome gradient = dpde("gradient s.dpde t --json");
  EXPECT_EQ(gradient.codes(), std::vector<std::string>{"W0806"}) << gradient.err;
  const Json growth = gradient.json()["growth"];
  EXPECT_EQ(growth["lost"], true);
  EXPECT_GT(growth["rounding"].get<double>(), 1e-3);
  EXPECT_LT(growth["safe_window"].get<double>(), 40);
}

/// exp(0.9*900) overflows: neither a silent NaN nor reported as an error of a formula.
TEST_F(GradientGrowth, BeyondAllNumbersIsTold) {
  write("s.dpde", lorenz("900"));
  for (const std::string verb : {"gradient s.dpde t --json", "optimize s.dpde t --json"}) {
    const Outcome outcome = dpde(verb);
    EXPECT_EQ(outcome.status, 1) << verb << outcome.err;
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0803"}) << verb << outcome.err;
    EXPECT_NE(outcome.err.find("the adjoint has grown by a factor of e^"), std::string::npos) << verb << outcome.err;
  }
}

/// Growth that the state shares costs no digit: u grows by exp(40), and so does its adjoint.
TEST_F(GradientGrowth, OfAStateThatGrowsLikewiseIsNoLoss) {
  write("s.dpde",
        "model m { field u; param r; dt(u) = r*u }\nscheme k { time = rk4 }\nscene s : m with k {\n"
        "  grid x = 0 .. 1, cells 4, periodic\n  r = 1\n  initial u = 1 + x\n  time 0 .. 40, step 0.01\n}\n"
        "task t : s {\n  unknown r from 1\n  minimise mean(u) at t = 40\n}\n");
  const Outcome gradient = dpde("gradient s.dpde t --json");
  ASSERT_EQ(gradient.status, 0) << gradient.err;
  const Json growth = gradient.json()["growth"];
  EXPECT_NEAR(growth["adjoint_rate"].get<double>(), 1, 1e-6) << growth;
  EXPECT_NEAR(growth["perturbation_rate"].get<double>(), 1, 1e-5) << growth;
  EXPECT_EQ(growth["lost"], false) << growth;
}

/// With diffusion nothing grows, and no additional run is made.
TEST_F(GradientGrowth, OfDiffusionIsNone) {
  write("s.dpde",
        "model m { field u; param k; dt(u) = k*lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 8, periodic\n"
        "  k = 1\n  initial u = sin(2*pi*x)\n  time 0 .. 1/8, step 1/512\n}\n"
        "task t : s {\n  unknown k from 0.5\n  minimise mean(u^2)\n}\n");
  const Json growth = dpde("gradient s.dpde t --json").json()["growth"];
  EXPECT_LT(growth["adjoint_rate"].get<double>(), 0) << growth;
  EXPECT_TRUE(growth["perturbation_rate"].is_null()) << growth;
}

}  // namespace
}  // namespace dpde::testing
