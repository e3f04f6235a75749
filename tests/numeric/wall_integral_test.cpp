// SPDX-License-Identifier: Apache-2.0
// Fluxes through walls, and torque on obstacles: balances, closed forms, orders, gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "../driver/driver_support.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// The observables of scene s at its begin and at its end.
std::pair<std::map<std::string, double>, std::map<std::string, double>> observed_inside_and_at_walls(
    const std::string& text, const Overrides& set = {}) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.name = "s";
  options.selection.overrides = set;
  DiagnosticSink sink;
  const auto code = compiled(source, options);
  const auto session = code ? driver::Session::open(source, code, {}, sink) : nullptr;
  EXPECT_TRUE(session) << all_messages(source, sink);
  if (!session) return {};
  std::pair<std::map<std::string, double>, std::map<std::string, double>> found;
  session->rollout().run({1 << 20, [&](const Snapshot& snapshot) {
                            if (snapshot.step > 0) return;
                            const auto values = session->observe(snapshot.t, snapshot.states);
                            found.first.insert(values.begin(), values.end());
                          }});
  const auto values = session->observe(session->end_time(), session->rollout().final_states());
  found.second.insert(values.begin(), values.end());
  return found;
}

std::string flux_plate(const std::string& initial, const std::string& rest, const std::string& x = "0 .. 1, cells 12") {
  return R"(
model heat { field T; param k; dt(T) = k*lap(T) }
scheme c { time = euler }
scene s : heat with c {
  grid x = )" +
         x + R"(
  grid y = 0 .. 2, cells 3
  k = 0.7
  boundary T: x.low = 1, x.high = mixed(1, 2, 0.5), y.low = gradient(0.3), y.high = 0
  initial T = )" +
         initial + R"(
  time 0 .. 1e-3, step 1e-3
  observe heat = integral(T)
  observe gain = integral(-k*dx(T), at = x.low) - integral(-k*dx(T), at = x.high)
  observe up = integral(-k*dy(T), at = y.low) + integral(k*dy(T), at = y.high)
)" + rest +
         "}\n";
}

/// A step's change equals the flux through the walls.
TEST(WallIntegral, FluxesBalance) {
  const auto [begin, end] = observed_inside_and_at_walls(flux_plate("1 + sin(3*x + y)", ""));
  EXPECT_NEAR((end.at("heat") - begin.at("heat")) / 1e-3, begin.at("gain") + begin.at("up"), 1e-11);
  EXPECT_NEAR(begin.at("up") - 0.7 * (-0.3), 2 * 0.7 * (0 - std::sin(0)), 10);  // it is a number
}

TEST(WallIntegral, OfLinearProfilesIsExact) {
  const std::string lines =
      "  observe low = integral(dx(T), at = x.low)\n  observe value = mean(T^2*x, at = y.high)\n"
      "    observe product = integral(dx(k*T*x), at = x.low)\n";
  const auto begin = observed_inside_and_at_walls(flux_plate("1 + 3*x", lines)).first;
  EXPECT_NEAR(begin.at("low"), 3 * 2, 1e-12);
  EXPECT_NEAR(begin.at("product"), 0.7 * 2, 1e-12);  // T is 1 there
  EXPECT_NEAR(begin.at("value"), 0, 1e-12);          // T is 0 there
}

/// The first mode decays: its flux pi*exp(-pi^2 t) has second order, also on stretched axes.
TEST(WallIntegral, IsOfSecondOrder) {
  const std::string text = R"(
model heat { field T; dt(T) = lap(T) }
scheme c { time = rk4 }
scene s : heat with c {
  grid x = 0 .. 1, cells 8
  boundary T: all = 0
  initial T = sin(pi*x)
  time 0 .. 0.02, step 1/12800
  observe flux = integral(dx(T), at = x.low)
}
)";
  std::string stretched = text;
  stretched.replace(stretched.find("cells 8"), 7, "cells 8, stretched x + 0.08*sin(2*pi*x)");
  const double exact = std::numbers::pi * std::exp(-std::numbers::pi * std::numbers::pi * 0.02);
  for (const std::string& each : {text, stretched}) {
    const double coarse = observed_inside_and_at_walls(each, {{"cells", "16"}}).second.at("flux") - exact;
    const double fine = observed_inside_and_at_walls(each, {{"cells", "32"}}).second.at("flux") - exact;
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.35);
    EXPECT_LT(std::abs(fine), 0.005);
  }
}

/// Fluid at rest under gravity: the pressures of floor and ceiling differ by the weight. A quadratic velocity is exact
/// on walls on which it lies.
TEST(WallIntegral, OfPressuresAndOfWhatLiesOnWalls) {
  const auto end = observed_inside_and_at_walls(R"(
model still {
  vector u on faces
  field p
  param nu
  dt(u) = -grad(p) + nu*lap(u) + (0, -3)
  0 = div(u) gives p
}
scheme c { time = rk2 }
scene s : still with c {
  grid x = 0 .. 2, cells 4, periodic
  grid y = 0 .. 1, cells 5
  nu = 0.1
  boundary u: y = (0, 0)
  initial u = 0
  time 0 .. 0.1, step 0.05
  observe weight = integral(p, at = y.low) - integral(p, at = y.high)
  observe lift = integral(dy(p), at = y.high)
}
)")
                       .second;
  EXPECT_NEAR(end.at("weight"), 3 * 2, 1e-9);
  EXPECT_NEAR(end.at("lift"), -3 * 2, 1e-9);
  const auto begin = observed_inside_and_at_walls(R"(
model carry { vector u on faces; dt(u) = lap(u) }
scheme c { time = euler }
scene s : carry with c {
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 2, cells 4, periodic
  boundary u: x = (4 + 2*x^2 - 3*x, 0)
  initial u = (4 + 2*x^2 - 3*x, 0)
  time 0 .. 1e-6, step 1e-6
  observe low = integral(dx(u.x) - u.x, at = x.low)
  observe high = integral(dx(u.x) + u.x*x, at = x.high)
}
)")
                         .first;
  EXPECT_NEAR(begin.at("low"), 2 * (-3 - 4), 1e-11);
  EXPECT_NEAR(begin.at("high"), 2 * (1 + 3), 1e-11);
}

/// Channel flow driven by a force per mass: in the steady state both walls together take the force, on any grid.
TEST(WallIntegral, WallsOfAChannelBearTheForce) {
  const auto end = observed_inside_and_at_walls(R"(
model channel { field u; param nu; dt(u) = 1.5 + nu*lap(u) }
scheme c { time = backward_euler }
scene s : channel with c {
  grid x = 0 .. 3, cells 2, periodic
  grid y = 0 .. 1, cells 5
  nu = 0.2
  boundary u: y = 0
  initial u = 0
  time 0 .. 1e9, step 1e9
  observe low = integral(nu*dy(u), at = y.low)
  observe high = integral(nu*dy(u), at = y.high)
}
)")
                       .second;
  EXPECT_NEAR(end.at("low"), 1.5 * 3 / 2, 1e-7);
  EXPECT_NEAR(end.at("high"), -1.5 * 3 / 2, 1e-7);
}

TEST(WallIntegral, DerivativesAreCertified) {
  const std::string text = R"(
model convection {
  vector u on faces
  field p, T
  param nu
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u) + (0, interpolate(T))
  dt(T) = -advect(u, T) + nu*lap(T)
  0 = div(u) gives p
}
scheme c { time = rk2 }
scene s : convection with c {
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 1, cells 5
  nu = 0.02
  boundary u: all = (0, 0)
  boundary T: x.low = 1, x.high = 0, y = zero_gradient
  initial u = 0
  initial T = 1 - x + 0.1*sin(pi*x)*cos(pi*y)
  time 0 .. 0.5, step 1/16
}
task t : s {
  unknown nu
  unknown initial T
  unknown initial u
  minimise integral(-nu*dx(T), at = x.low) + mean(u.x^2) over time
  minimise mean(p + 2*nu*dy(u.y) - T*y, at = y.high) + integral(nu*dy(u.x), at = y.low)
}
)";
  expect_certified(text, false);
}

/// A cylinder that turns in fluid at rest far away: u = w*R^2/r, and the torque on it is -4*pi*nu*w*R^2. The box has
/// that velocity on its walls. With staircases the error is of first order.
TEST(Torque, OfACylinderThatTurns) {
  const std::string text = R"(
model flow {
  vector u on faces
  field p
  param nu, R
  mask solid
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = (-y, x) inside solid
}
scheme c { time = rk2 }
scene s : flow with c {
  grid x = -1 .. 1, cells 20
  grid y = -1 .. 1, cells 20
  nu = 1
  R = 0.4
  solid = x^2 + y^2 < R^2
  boundary u: all = (-y*R^2/(x^2 + y^2), x*R^2/(x^2 + y^2))
  initial u = (if(x^2 + y^2 < R^2, -y, -y*R^2/(x^2 + y^2)), if(x^2 + y^2 < R^2, x, x*R^2/(x^2 + y^2)))
  time 0 .. 0.2, step 1/500
  observe torque = torque_on(solid, u, about = (0, 0))
  observe moved = torque_on(solid, u, about = (0.3, -0.2))
  observe fx = force_on(solid, u.x)
}
)";
  const auto end = observed_inside_and_at_walls(text).second;
  const double exact = -4 * std::numbers::pi * 0.4 * 0.4;
  EXPECT_NEAR(end.at("torque") / exact, 1, 0.1);
  EXPECT_NEAR(end.at("fx"), 0, 1e-8);
  EXPECT_NEAR(end.at("moved"), end.at("torque"), 1e-8);  // no net force: the reference point does not matter
  std::string task = text +
                     "task t : s {\n  unknown nu\n  unknown initial u\n  minimise torque_on(solid, u, about = "
                     "(0.1, 0)) over time\n}\n";
  for (const auto& [from, to] : {std::pair{"cells 20", "cells 6"}, {"cells 20", "cells 5"}, {".. 0.2, ", ".. 0.01, "}})
    task.replace(task.find(from), std::string(from).size(), to);
  expect_certified(task, false);
}

}  // namespace
}  // namespace dpde::testing
