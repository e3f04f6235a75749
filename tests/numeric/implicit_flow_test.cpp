// SPDX-License-Identifier: Apache-2.0
// Flows with stages solved by Newton's method, including advection: constraints and masks after and in these solves,
// orders in time, derivatives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/flow_texts.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Between walls, or periodic on both axes; `solid` is a condition, `start` follows the formula of u.
std::string stream(const std::string& scheme, bool has_walls, const std::string& solid = "x < 0",
                   const std::string& start = "") {
  return flow_around_a_solid + std::string("scheme c { ") + scheme + R"( }
scene s : m with c {
  grid x = 0 .. 1, cells 12, periodic
  grid y = 0 .. 1, cells 10)" +
         (has_walls ? "\n  boundary u: y = (0, 0)" : ", periodic") + R"(
  nu = 0.05
  solid = )" +
         solid + R"(
  initial u = (sin(2*pi*x)*cos(2*pi*y) + 0.3, 0.5*sin(2*pi*x)*sin(2*pi*y)) )" +
         start + R"(
  time 0 .. 1/4, step 1/16
}
task t : s {
  unknown nu
  unknown initial u
  minimise mean(u.x^2) over time
  minimise mean(u.y^3) over time
}
task miss : s { unknown nu; minimise mean(div(u)^2) }
)";
}
const std::string disc = "(x - 0.5)^2 + (y - 0.5)^2 < 0.03";

double apart(const std::map<std::string, std::vector<double>>& a, const std::map<std::string, std::vector<double>>& b) {
  double most = 0;
  for (const char* field : {"u.x", "u.y"}) {
    for (std::size_t i = 0; i < a.at(field).size(); ++i)
      most = std::max(most, std::abs(a.at(field)[i] - b.at(field).at(i)));
  }
  return most;
}

double order_of(const std::string& scheme, bool has_walls) {
  const std::string text = stream(scheme, has_walls, "x < 0", "projected");
  const auto at = [&](const char* step) { return run_scene(text, "s", {{"step", step}}).state; };
  const auto finest = at("1/512");
  return std::log2(apart(at("1/32"), finest) / apart(at("1/64"), finest));
}

TEST(ImplicitFlow, HasTheOrderOfItsScheme) {
  for (const bool has_walls : {false, true}) {
    EXPECT_NEAR(order_of("implicit = all; time = backward_euler", has_walls), 1, 0.25) << has_walls;
    EXPECT_NEAR(order_of("implicit = all; time = crank_nicolson", has_walls), 2, 0.3) << has_walls;
    EXPECT_NEAR(order_of("implicit = all; time = ars222", has_walls), 2, 0.3) << has_walls;
    EXPECT_NEAR(order_of("implicit = all_but_advect; time = ars222", has_walls), 2, 0.3) << has_walls;
    if (!testing::is_thorough()) continue;
    EXPECT_NEAR(order_of("implicit = all; time = ars443", has_walls), 2, 0.3) << has_walls;
  }
  if (!testing::is_thorough()) return;
  EXPECT_NEAR(order_of("implicit = all_but_advect; time = ars443", false), 3, 0.3);
}

/// Another scheme gives the same flow, also around an obstacle.
TEST(ImplicitFlow, IsTheFlowOfExplicitSteps) {
  for (const std::string& solid : {std::string("x < 0"), disc}) {
    const auto by = [&](const char* scheme, const char* step) {
      return run_scene(stream(scheme, true, solid, "projected"), "s", {{"step", step}}).state;
    };
    EXPECT_LT(apart(by("implicit = all; time = ars443", "1/256"), by("time = rk4", "1/1024")), 2e-4) << solid;
  }
}

/// Without advection all terms are linear: equal to separate linear solves of each field.
TEST(ImplicitFlow, OfLinearTermsIsThatOfLinearSolves) {
  const auto by = [](const char* scheme) {
    const std::string text = std::string(R"(
model stokes {
  vector u on faces
  field p, T
  mask solid
  dt(u) = -grad(p) + 0.1*lap(u)
  dt(T) = 0.05*lap(T)
  0 = div(u) gives p
  u = (0.2*cos(3*t), sin(t)) inside solid
  T = 1 + t inside solid
}
scheme c { )") + scheme + R"( }
scene s : stokes with c {
  grid x = 0 .. 1, cells 9
  grid y = 0 .. 1, cells 8
  boundary u: all = (0, 0)
  boundary T = 0
  solid = )" + disc + R"(
  initial u = (sin(pi*x)*y, 0)
  initial T = x*y
  time 0 .. 1, step 1/8
}
)";
    return run_scene(text, "s").state;
  };
  for (const char* time : {"; time = backward_euler", "; time = ars222", "; time = ars443"}) {
    const auto linear = by((std::string("implicit = linear") + time).c_str()),
               all = by((std::string("implicit = all") + time).c_str());
    for (const char* field : {"u.x", "u.y", "T"}) {
      for (std::size_t i = 0; i < all.at(field).size(); ++i)
        EXPECT_NEAR(all.at(field)[i], linear.at(field)[i], 1e-10) << time << " " << field;
    }
  }
}

TEST(ImplicitFlow, KeepsTheConstraintAndWhatMasksHold) {
  const std::string text = stream("implicit = all; time = ars222", true, disc);
  EXPECT_LT(task_loss(text, "miss"), 1e-20);
  const auto state = run_scene(text, "s").state;
  EXPECT_EQ(state.at("u.x")[5 * 12 + 5], 0);
  EXPECT_EQ(state.at("u.y")[4 * 12 + 6], 0);
  const auto interpreted = run_scene(text, "s", {{"end", "1/8"}}, driver::Backend::interpreter).state;
  EXPECT_LT(apart(run_scene(text, "s", {{"end", "1/8"}}).state, interpreted), 1e-10);
}

TEST(ImplicitFlow, DerivativesAreCertified) {
  for (const char* time : {"backward_euler", "crank_nicolson", "ars222", "ars443"}) {
    const std::string scheme = std::string("implicit = all; time = ") + time;
    expect_certified(stream(scheme, true, disc), std::string(time) == "ars222");
  }
}

/// A channel with an open end; the velocity on that wall is an unknown of the solve like all others. At rest it is the
/// flow of explicit steps, with pressure 8 nu (2 - x).
std::string channel(const std::string& scheme, const std::string& cells, const std::string& time) {
  return incompressible_flow + std::string("scheme c { ") + scheme +
         " }\nscene s : flow with c {\n  grid x = 0 .. 2, " + cells +
         "  nu = 0.05\n  initial u = 0\n  boundary u.x: x.low = 4*y*(1 - y), x.high = outflow, y = 0\n" +
         "  boundary u.y: x.low = 0, x.high = outflow, y = 0\n  time " + time +
         "\n}\ntask mean_p : s { unknown nu; minimise mean(p) }\ntask t : s { unknown nu; unknown initial u; minimise "
         "mean(u.x^2) over time; minimise mean(p^2) }\n";
}

TEST(ImplicitFlow, LeavesThroughOpenEndsAsThatOfExplicitSteps) {
  const auto mean_p = [](const std::string& scheme, int cells) {
    const std::string n = std::to_string(cells);
    return task_loss(channel(scheme, "cells " + n + "\n  grid y = 0 .. 1, cells " + n + "\n",
                             "0 .. 20, step 1/100, until steady 1e-9"),
                     "mean_p");
  };
  double error = 0;
  for (const int cells : {8, 16}) {
    const double known = mean_p("time = rk4", cells);
    for (const char* scheme : {"time = backward_euler", "time = ars222; implicit = all"})
      EXPECT_NEAR(mean_p(scheme, cells), known, 1e-7) << scheme;
    if (error > 0) EXPECT_GT(std::log2(error / (0.4 - known)), 1.7);
    error = 0.4 - known;
  }
}

TEST(ImplicitFlow, LeavesThroughOpenEndsWithCertifiedDerivatives) {
  const std::string linear = "time = ars222", all = "time = backward_euler; implicit = all";
  for (const auto& [scheme, cells] : {std::pair{linear, "cells 5\n  grid y = 0 .. 1, cells 4\n"},
                                      {linear, "cells 2\n  grid y = 0 .. 1, cells 1\n"},
                                      {all, "cells 1\n  grid y = 0 .. 1, cells 2\n"}})
    expect_certified(channel(scheme, cells, "0 .. 0.1, step 0.05"), false);
}

}  // namespace
}  // namespace dpde::testing
