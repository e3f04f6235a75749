// SPDX-License-Identifier: Apache-2.0
// Unknown weights of mixed boundaries a*u + b*du/dn = c: a closed form, certified derivatives of first and second
// order, and recovery of a weight.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// One cell of width 1, one Euler step: u becomes u0 + dt*(v_low - 2*u0 + v_high), v the ghost value beyond each wall.
TEST(WallWeight, HasTheGradientOfTheClosedForm) {
  const double a = 0.7, b = 1.3, c = 0.4, u0 = 0.9, dt = 0.125;
  const auto image = [&](double weight_a, double weight_b) {
    return (2 * c - (weight_a - 2 * weight_b) * u0) / (weight_a + 2 * weight_b);
  };
  const auto image_by_a = [&](double by_a,
                              double by_b) {  // from 2c - (a - 2b)*u0 = v*(a + 2b), with da = by_a, db = by_b
    const double v = image(a, b);
    return (-(by_a - 2 * by_b) * u0 - v * (by_a + 2 * by_b)) / (a + 2 * b);
  };
  const double end = u0 + dt * (2 * image(a, b) - 2 * u0);
  const TaskResult result = task_gradient(
      "model m { field u; param a, b; dt(u) = lap(u) }\nscheme e { time = euler }\nscene s : m with e {\n  grid x = 0 "
      ".. 1, cells 1\n  a = 0.7\n  b = 1.3\n"
      "  boundary u: x = mixed(a, b, 0.4)\n  initial u = 0.9\n  time 0 .. 0.125, step 0.125\n}\n"
      "task t : s {\n  unknown a\n  unknown b\n  minimise mean(u^2)\n}\n",
      "t");
  EXPECT_NEAR(result.loss, end * end, 1e-14);
  EXPECT_NEAR(result.gradient.at("a").at(0), 2 * end * dt * 2 * image_by_a(1, 0), 1e-14);
  EXPECT_NEAR(result.gradient.at("b").at(0), 2 * end * dt * 2 * image_by_a(0, 1), 1e-14);
}

std::string mixed_plate(const std::string& boundary, const std::string& x, const std::string& y,
                        const std::string& scheme) {
  return "model m { field u; coefficient g; param a, b, A; dt(u) = 0.1*lap(u) - 0.2*u*dx(u) }\nscheme c { " + scheme +
         " }\nscene s : m with c {\n"
         "  grid x = 0 .. 1, cells " +
         x + "\n  grid y = 0 .. 1, cells " + y + "\n  a = 0.6\n  b = 0.3\n  A = 0.5\n  g = 1 + y\n" + boundary +
         "\n  initial u = 1 + x\n  time 0 .. 1/32, step 1/256\n}\n"
         "task t : s {\n  unknown a\n  unknown b\n  unknown A\n  minimise mean(u^3) + mean(dx(u)^2)\n}\n";
}

TEST(WallWeight, DerivativesAreCertified) {
  for (const std::string x : {"1", "2", "3", "6"}) {
    for (const std::string y : {"4, periodic", "1", "3"}) {
      SCOPED_TRACE(x + " x " + y);
      const std::string ends = y == "4, periodic" ? "" : ", y.low = mixed(1, A, a), y.high = A*x";
      expect_certified(
          mixed_plate("  boundary u: x.low = mixed(a, b*(1 + t), g*A), x.high = mixed(1 + a^2, sin(b), 0.5)" + ends, x,
                      y, "time = rk2"),
          x == "2" || y == "3");
    }
  }
}

/// Differences over several ghost cells, also beyond the opposite wall for few cells.
TEST(WallWeight, DerivativesOfWideDifferencesAreCertified) {
  for (const std::string x : {"1", "2", "5"}) {
    expect_certified(mixed_plate("  boundary u: x = mixed(a, b, A), y = mixed(b, 1, 0)", x, "3",
                                 "time = euler; dx = central(4); lap = central(4)"),
                     true);
  }
}

TEST(WallWeight, OnAStretchedAxisAndOfVelocitiesIsCertified) {
  expect_certified(
      "model m { field u; param a, b; dt(dt(u)) = lap(u) - 0.1*dt(u) }\nscheme c { time = rk4 }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 7, stretched tanh(2*x)/tanh(2)\n  a = 0.6\n  b = 0.3\n  boundary u: x.low = mixed(a, "
      "b, 0.2), x.high = mixed(b, 1, t)\n"
      "  initial u = x\n  initial dt(u) = 1\n  time 0 .. 1/8, step 1/128\n}\ntask t : s {\n  unknown a\n  unknown b\n  "
      "minimise mean(u^2)\n}\n",
      true);
}

/// Heat transfer of a rod to air: the coefficient is estimated from the end's temperature.
TEST(WallWeight, IsFoundAgain) {
  const std::string text =
      "model rod { field u; param h; dt(u) = lap(u) }\nscheme c { time = rk4 }\n"
      "scene truth : rod with c {\n  grid x = 0 .. 1, cells 16\n  h = 2.5\n  boundary u: x.low = 1, x.high = mixed(h, "
      "1, 0)\n  initial u = 1\n  time 0 .. 0.25, step 1/2048\n}\n"
      "scene s : rod with c {\n  grid x = 0 .. 1, cells 16\n  h = 1\n  boundary u: x.low = 1, x.high = mixed(h, 1, "
      "0)\n  initial u = 1\n  time 0 .. 0.25, step 1/2048\n}\n"
      "task t : s {\n  data v = u from scene truth\n  unknown h\n  minimise mean((u - v)^2)\n}\n";
  const double at_the_truth = task_gradient(text, "t", {{"h", "2.5"}}).gradient.at("h").at(0);
  EXPECT_LT(std::abs(at_the_truth), 1e-14);
  EXPECT_LT(task_gradient(text, "t").gradient.at("h").at(0), -1e-4);
}

}  // namespace
}  // namespace dpde::testing
