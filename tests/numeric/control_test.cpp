// SPDX-License-Identifier: Apache-2.0
// Controls: gradients with one value per interval against closed forms; certified first and second derivatives.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// u grows by dt*F[n] in step n: u(1) = sum of dt*F.
std::string sum_of_pushes(const std::string& control, const std::string& task) {
  return "model m { field u; control F; dt(u) = F }\nscheme c { time = euler }\nscene s : m with c {\n"
         "  grid x = 0 .. 1, cells 3, periodic\n  initial u = x\n  time 0 .. 1, step 1/8\n  " +
         control +
         "\n}\n"
         "task t : s {\n  unknown F from 2\n  " +
         task + "\n}\n";
}

TEST(Control, HasAValueEachInterval) {
  const auto end = [](const std::string& control) {
    return run_scene(sum_of_pushes(control, "minimise mean(u)"), "s").state.at("u")[0] - 1. / 6;
  };
  double midpoints = 0, thirds = 0;
  for (int n = 0; n < 8; ++n) midpoints += std::pow((n + 0.5) / 8, 2) / 8;
  for (int n = 0; n < 8; ++n) thirds += std::pow(n < 3 ? 1.5 / 8 : n < 6 ? 4.5 / 8 : 7.5 / 8, 2) / 8;
  EXPECT_NEAR(end("F = t^2"), midpoints, 1e-14);
  EXPECT_NEAR(end("F = t^2 every 3/8"), thirds, 1e-14);
  EXPECT_NEAR(end("F = 1 every 1"), 1, 1e-14);
  EXPECT_NEAR(run_scene(sum_of_pushes("F = t^2", "minimise mean(u)"), "s", {{"F", "0.5"}}).state.at("u")[0] - 1. / 6,
              0.5, 1e-14);
}

/// d mean(u(1)^2) / dF[k] = 2 mean(u(1)) dt * (steps of interval k), with u(1) = x + 2.
TEST(Control, GradientIsOneNumberAnInterval) {
  const std::vector<double> each = task_gradient(sum_of_pushes("", "minimise mean(u^2)"), "t").gradient.at("F");
  ASSERT_EQ(each.size(), 8u);
  for (const double g : each) EXPECT_NEAR(g, 2 * 2.5 / 8, 1e-13);
  const std::vector<double> thirds =
      task_gradient(sum_of_pushes("F = 0 every 3/8", "minimise mean(u^2)"), "t").gradient.at("F");
  ASSERT_EQ(thirds.size(), 3u);
  EXPECT_NEAR(thirds[0], 2 * 2.5 * 3 / 8, 1e-13);
  EXPECT_NEAR(thirds[2], 2 * 2.5 * 2 / 8, 1e-13);
}

/// The mean of F^2 over the 9 states: in each state the value of its interval; the last interval includes the end.
TEST(Control, CostsSomethingInTheLoss) {
  const TaskResult result = task_gradient(sum_of_pushes("F = 0 every 1/2", "minimise F^2, mean over time"), "t");
  EXPECT_NEAR(result.loss, 4, 1e-13);
  const std::vector<double>& g = result.gradient.at("F");
  ASSERT_EQ(g.size(), 2u);
  EXPECT_NEAR(g[0], 2 * 2 * 4. / 9, 1e-13);
  EXPECT_NEAR(g[1], 2 * 2 * 5. / 9, 1e-13);
}

/// u_t = F(t) u at every stage of a step with the same F: u(1) = u(0) prod R(F[n] dt), R the stability function of RK4.
TEST(Control, IsTheSameInAllStagesOfAStep) {
  std::string text = sum_of_pushes("F = t", "minimise mean(u)");
  text.replace(text.find("dt(u) = F "), 10, "dt(u) = F*u ");
  text.replace(text.find("euler"), 5, "rk4");
  double expected = 1. / 6;
  for (int n = 0; n < 8; ++n) {
    const double z = (n + 0.5) / 64;
    expected *= 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24;
  }
  EXPECT_NEAR(run_scene(text, "s").state.at("u")[0], expected, 1e-14);
}

/// At a wall the step's own interval applies: compared with hand-written steps, also for an unknown control.
TEST(Control, ActsAtBoundariesInItsOwnStep) {
  const std::string text =
      "model m { field u; control F; dt(u) = lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n  grid x = 0 "
      ".. 1, cells 4\n"
      "  boundary u: x.low = F, x.high = zero_gradient\n  initial u = 0\n  time 0 .. 1/4, step 1/64\n  F = t^2\n}\n"
      "task t : s {\n  unknown F\n  minimise mean(u^2)\n}\n";
  std::vector<double> u(4, 0.0);
  for (int n = 0; n < 16; ++n) {
    const double f = std::pow((n + 0.5) / 64, 2), h = 0.25;
    std::vector<double> next(4);
    for (int i = 0; i < 4; ++i) {
      const double left = i == 0 ? 2 * f - u[0] : u[i - 1], right = i == 3 ? u[3] : u[i + 1];
      next[i] = u[i] + (left - 2 * u[i] + right) / (64 * h * h);
    }
    u = next;
  }
  double loss = 0;
  for (const double value : u) loss += value * value / 4;
  const std::vector<double> run = run_scene(text, "s").state.at("u");
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(run[i], u[i], 1e-15);
  EXPECT_NEAR(task_loss(text, "t"), loss, 1e-16);
}

TEST(Control, DerivativesAreCertified) {
  const std::string text =
      "model m {\n  field u\n  param nu\n  control F, G\n  dt(u) = nu*lap(u) - F*u^2 + x*F*G\n}\nscheme c { time = rk2 "
      "}\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 9\n  boundary u: x.low = G, x.high = gradient(F*sin(t))\n  nu = "
      "0.02\n"
      "  initial u = sin(x)\n  time 0 .. 1, step 1/32\n  F = cos(t) every 1/8\n  G = 0.3\n  every 1/4: u += 0.1*F\n}\n"
      "task t : s {\n  unknown F\n  unknown G from t\n  unknown nu\n  minimise mean(u^2)\n  minimise mean(F*u^2) + "
      "0.1*G^2, mean over time\n}\n";
  expect_certified(text, true);
}

}  // namespace
}  // namespace dpde::testing
