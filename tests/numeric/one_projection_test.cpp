// SPDX-License-Identifier: Apache-2.0
// 0 = div(u) gives p each step: one projection, after stages that use the p of the step before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Flows with a discretely divergence-free start, periodic and between a moving wall and a wall at rest, driven by a
/// force that depends on t.
std::string flows(const std::string& often) {
  return R"(
model flow {
  vector u on faces
  field p
  param nu, k
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u) + (0, 0.5*sin(2*t)*cos(k*x))
  0 = div(u) gives p )" +
         often + R"(
}
scheme c { time = rk4 }
scene ring : flow with c {
  grid x = 0 .. 2*pi, cells 12, periodic
  grid y = 0 .. 2*pi, cells 12, periodic
  nu = 0.05; k = 1
  initial u = (1 + sin(x)*cos(y) + 0.5*sin(2*y), 0.5 - cos(x)*sin(y) + 0.3*cos(x)) projected
  time 0 .. 1, step 1/8
}
scene walls : flow with c {
  grid x = 0 .. 2, cells 12, periodic
  grid y = 0 .. 1, cells 6
  nu = 0.02; k = pi
  boundary u: y.low = 0, y.high = (1, 0)
  initial u = (y^3 + sin(pi*x)*sin(pi*y)^2, cos(pi*x)*sin(pi*y)) projected
  time 0 .. 0.5, step 1/16
}
)";
}

using Fields = std::map<std::string, std::vector<double>>;

double distance(const Fields& a, const Fields& b, std::initializer_list<const char*> names) {
  double largest = 0;
  for (const char* name : names) {
    for (std::size_t i = 0; i < a.at(name).size(); ++i)
      largest = std::max(largest, std::abs(a.at(name)[i] - b.at(name)[i]));
  }
  return largest;
}

/// All at night.
std::vector<const char*> some(std::vector<const char*> all, std::size_t by_day) {
  if (!is_thorough()) all.resize(by_day);
  return all;
}

/// A step with one stage is unchanged.
TEST(OneProjection, OfOneStageIsTheSame) {
  for (const char* time : some({"euler", "ab2", "imex_euler"}, 1)) {
    const Fields a = run_scene(flows("each step"), "walls", {{"time", time}}).state,
                 b = run_scene(flows(""), "walls", {{"time", time}}).state;
    EXPECT_EQ(a, b) << time;
  }
}

/// Without the p of the step before the order would be 1. If the start has no better p than 0, the error of the first
/// step alone is of order 2, which does not reduce the order.
TEST(OneProjection, HasOrderTwo) {
  for (const char* scene : {"ring", "walls"}) {
    const Fields best = run_scene(flows(""), scene, {{"step", "1/512"}}).state;
    for (const char* time : some({"rk4", "ars222", "rk2", "ssp_rk3", "dopri5", "ars443"}, 2)) {
      const auto error = [&](const char* step) {
        const Fields found = run_scene(flows("each step"), scene, {{"time", time}, {"step", step}}).state;
        return distance(found, best, {"u.x", "u.y"});
      };
      const double coarse = error("1/32"), fine = error("1/64");
      EXPECT_NEAR(std::log2(coarse / fine), 2, 0.25) << scene << " " << time;
      EXPECT_LT(fine, 2e-3) << scene << " " << time;
    }
  }
}

/// p is its mean over the last step: the value in the middle, to order 2.
TEST(OneProjection, PressureIsThatOfTheMiddleOfTheStep) {
  const auto pressure = [&](const char* often, const char* time, const char* end, const char* step) {
    return run_scene(flows(often), "ring", {{"time", time}, {"end", end}, {"step", step}}).state;
  };
  const auto error = [&](const char* end, const char* step, const char* middle) {
    const Fields best = pressure("", "euler", middle, "1/4096");  // p at the beginning of the last step
    return distance(pressure("each step", "rk4", end, step), best, {"p"});
  };
  const double coarse = error("1/4", "1/32", "15/64"), fine = error("1/4", "1/64", "31/128");
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.5);
}

TEST(OneProjection, IsTheSameInTheInterpreter) {
  for (const char* time : some({"rk4", "ars222", "ssp_rk3"}, 2)) {
    const Overrides few{{"end", "1/4"}, {"time", time}};
    const Fields machine = run_scene(flows("each step"), "walls", few).state,
                 other = run_scene(flows("each step"), "walls", few, driver::Backend::interpreter).state;
    EXPECT_LT(distance(machine, other, {"u.x", "u.y", "p"}), 1e-12) << time;
  }
}

TEST(OneProjection, TheSchemeTakesThePlaceOfWhatIsWritten) {
  const auto end = [](const std::string& often, const Overrides& set) {
    return run_scene(flows(often), "walls", set).state;
  };
  EXPECT_EQ(end("each step", {}), end("", {{"project", "step"}}));
  EXPECT_EQ(end("each step", {{"project", "stage"}}), end("each stage", {}));
  EXPECT_EQ(end("each stage", {}), end("", {}));
  EXPECT_GT(distance(end("each step", {}), end("", {}), {"u.x"}), 1e-5);
}

/// Around a disc between an inflow profile and an open end: the mask acts in all stages.
std::string around_disc(const std::string& often, const std::string& task = "") {
  return R"(
model flow {
  vector u on faces
  field p
  mask solid
  param nu, a
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p )" +
         often + R"(
  u = (a*sin(t), 0) inside solid
}
scheme c { time = rk4 }
scene disc : flow with c {
  grid x = 0 .. 2, cells 12
  grid y = 0 .. 1, cells 6
  nu = 0.05; a = 0.2
  solid = (x - 0.6)^2 + (y - 0.5)^2 < 0.03
  boundary u.x: x.low = 6*y*(1 - y), x.high = outflow, y = 0
  boundary u.y: x.low = 0, x.high = outflow, y = 0
  initial u = (6*y*(1 - y), 0) projected
  time 0 .. 0.25, step 1/32
}
)" + task;
}

TEST(OneProjection, HoldsMasksInEachStage) {
  const Fields best = run_scene(around_disc(""), "disc", {{"step", "1/512"}}).state;
  for (const char* time : some({"rk4", "ars222", "ssp_rk3"}, 1)) {
    const auto error = [&](const char* step) {
      const Fields found = run_scene(around_disc("each step"), "disc", {{"time", time}, {"step", step}}).state;
      return distance(found, best, {"u.x", "u.y"});
    };
    EXPECT_NEAR(std::log2(error("1/64") / error("1/128")), 2, 0.3) << time;
  }
}

/// Values, tangents, adjoints and second derivatives; substeps from a Courant number, walls, masks, few cells.
TEST(OneProjection, HasExactDerivatives) {
  const auto of_flow = [](const std::string& scene, const std::string& more) {
    return flows("each step") + "scene few = " + scene + " { " + more +
           " }\ntask t : few { unknown k; unknown nu; unknown initial p; minimise mean(u.x^2) over time\n"
           "  minimise mean(u.y^3 + u.x); minimise 0.1*mean(p^2) }\n";
  };
  for (const char* time : some({"rk4", "ars222", "rk2", "ssp_rk3"}, 1)) {
    for (const char* cells : some({"cells 3, 4", "cells 1, 2"}, 1)) {
      std::string text = of_flow("walls", std::string(cells) + "; time 0 .. 1/8, step 1/32");
      text.replace(text.find("time = rk4"), 10, std::string("time = ") + time);
      expect_certified(text, true);
    }
  }
  if (is_thorough()) expect_certified(of_flow("ring", "cells 4, 3; time 0 .. 1/4, step 1/8, courant 0.2"), true);
  expect_certified(around_disc("each step",
                               "task t : disc { unknown a; unknown nu; minimise mean(u.x^2) over time\n"
                               "  minimise force_on(solid, u.x)^2 }\n"),
                   true);
}

}  // namespace
}  // namespace dpde::testing
