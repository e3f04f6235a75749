// SPDX-License-Identifier: Apache-2.0
// initial u = ... projected: the run starts with the constraint fulfilled, and derivatives include this.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Between walls; `start` follows the formula of u.
std::string stirred(const std::string& start, const std::string& step = "1/32", const std::string& time = "rk4") {
  return R"(
model flow {
  vector u on faces
  field p
  param nu, k
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
}
scheme c { time = )" +
         time + R"( }
scene s : flow with c {
  grid x = 0 .. 2, cells 14, periodic
  grid y = 0 .. 1, cells 9
  nu = 0.02; k = 1.7
  boundary u: y = 0
  initial u = (sin(pi*x)*cos(y) + y^2, k*cos(pi*x)*sin(pi*y)) )" +
         start + R"(
  time 0 .. 0.5, step )" +
         step + R"(
}
task at_start : s { unknown k; minimise mean(u.x^2) + mean(u.y^2) at t = 0 }
task miss : s { unknown k; minimise mean(div(u)^2) at t = 0 }
task t : s { unknown k; unknown nu; minimise mean(u.x^2) over time; minimise mean(u.y^3) at t = 0 }
)";
}

double energy(const std::string& text, const Overrides& overrides = {}) {
  return task_loss(text, "at_start", overrides);
}

/// The projection removes energy, and the derivative agrees with central differences.
TEST(ProjectedStart, MakesTheConstraintTrueAndHasDerivatives) {
  const std::string text = stirred("projected");
  EXPECT_GT(task_loss(stirred(""), "miss"), 0.1);
  EXPECT_LT(task_loss(text, "miss"), 1e-25);
  EXPECT_LT(energy(text), 0.9 * energy(stirred("")));
  const double slope = (energy(text, {{"k", "1.7001"}}) - energy(text, {{"k", "1.6999"}})) / 2e-4;
  EXPECT_NEAR(task_gradient(text, "at_start").gradient.at("k").front() / slope, 1, 1e-6);
  for (const char* time : {"rk4", "ars222"}) expect_certified(stirred("projected", "1/32", time), true);
}

TEST(ProjectedStart, IsTheSameInTheInterpreter) {
  const Overrides few{{"end", "1/8"}};
  const auto machine = run_scene(stirred("projected"), "s", few).state;
  const auto interpreted = run_scene(stirred("projected"), "s", few, driver::Backend::interpreter).state;
  for (const char* field : {"u.x", "u.y"}) {
    for (std::size_t i = 0; i < machine.at(field).size(); ++i)
      EXPECT_NEAR(machine.at(field)[i], interpreted.at(field)[i], 1e-12);
  }
}

/// Without it the first step uses right-hand sides of an impossible flow, and the order is 1.
TEST(ProjectedStart, LeavesTheOrderOfTheScheme) {
  const auto order = [](const std::string& start) {
    const auto left = [&](const char* step) { return run_scene(stirred(start, step), "s").state.at("u.x"); };
    const auto finest = left("1/1024"), coarse = left("1/32"), fine = left("1/64");
    double of_coarse = 0, of_fine = 0;
    for (std::size_t i = 0; i < finest.size(); ++i) {
      of_coarse = std::max(of_coarse, std::abs(coarse[i] - finest[i]));
      of_fine = std::max(of_fine, std::abs(fine[i] - finest[i]));
    }
    return std::log2(of_coarse / of_fine);
  };
  EXPECT_NEAR(order("projected"), 4, 0.3);
  EXPECT_NEAR(order(""), 1, 0.3);
}

/// From rest between an inflow profile and an open end, around a disc. The flux through each row of faces is the
/// inflow: the mean of 6 y (1 - y) at the centres of 12 cells.
TEST(ProjectedStart, KnowsObstaclesAndOpenEnds) {
  const std::string text = R"(
model flow {
  vector u on faces
  field p
  coefficient inflow
  mask solid
  param nu
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = 0 inside solid
}
scene s : flow {
  grid x = 0 .. 2, cells 24
  grid y = 0 .. 1, cells 12
  nu = 0.05
  solid = (x - 0.6)^2 + (y - 0.5)^2 < 0.03
  inflow = 6*y*(1 - y)
  boundary u.x: x.low = inflow, x.high = outflow, y = 0
  boundary u.y: x.low = 0, x.high = outflow, y = 0
  initial u = 0 projected
  time 0 .. 0.1, step 0.01
}
task miss : s { unknown nu; minimise mean(div(u)^2) at t = 0 }
task through : s { unknown nu; minimise mean(u.x) at t = 0 }
)";
  EXPECT_LT(task_loss(text, "miss"), 1e-20);
  EXPECT_NEAR(task_loss(text, "through"), 1 + 1.0 / 288, 1e-10);
}

}  // namespace
}  // namespace dpde::testing
