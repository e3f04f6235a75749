// SPDX-License-Identifier: Apache-2.0
// Equations with several substeps per step, against closed forms, and against the same steps written differently.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// a' = a cos t has the solution e^sin(t), and so has b' = 8 (a - b) + a cos t. `back`: b acts on a without changing
/// the solution.
double error_of_coupled(const std::string& scheme, int steps, int parts, double back = 0) {
  const std::string text = fmt::format(
      "model m {{\n  field a, b\n  dt(a) = a*cos(t) + {}*(b - a)\n  dt(b) = 8*(a - b) + a*cos(t)\n}}\nscheme c {{ time "
      "= {} }}\n"
      "scene s : m with c {{\n  grid x = 0 .. 1, cells 2, periodic\n  initial a = 1\n  initial b = 1\n  time 0 .. 2, "
      "step 1/{}\n  subcycle b in {}\n}}\n",
      back, scheme, steps, parts);
  const SceneResult result = run_scene(text, "s");
  if (result.state.empty()) return NAN;
  return std::abs(result.state.at("b")[0] - std::exp(std::sin(2.0)));
}

double order_of_coupled(const std::string& scheme, int parts, double back = 0) {
  return std::log2(error_of_coupled(scheme, 64, parts, back) / error_of_coupled(scheme, 128, parts, back));
}

TEST(Subcycle, KeepsTheOrderFromSlowToFast) {
  EXPECT_NEAR(order_of_coupled("euler", 4), 1, 0.1);
  for (const std::string scheme : {"rk2", "ssp_rk3", "rk4", "bs32", "dopri5"}) {
    EXPECT_NEAR(order_of_coupled(scheme, 3), 2, 0.1) << scheme;
    EXPECT_NEAR(order_of_coupled(scheme, 8), 2, 0.1) << scheme;
  }
}

TEST(Subcycle, IsOfOrderOneInBothDirections) { EXPECT_NEAR(order_of_coupled("rk4", 4, 3), 1, 0.15); }

std::string diffusion(const std::string& more) {
  return "model m { field u; dt(u) = lap(u)*(1 + t) + sin(t) }\nscene s : m with c {\n  grid x = 0 .. 1, cells 7\n  "
         "grid y = 0 .. 1, cells 4, periodic\n"
         "  boundary u: x.low = cos(9*t), x.high = gradient(t*y)\n  initial u = cos(x + 6*y)\n  " +
         more + "\n}\n";
}

/// If all equations have substeps, these are shorter steps.
TEST(Subcycle, OfAllIsAShorterStep) {
  for (const std::string scheme : {"euler", "rk2", "ssp_rk3", "rk4"}) {
    const std::string c = "scheme c { time = " + scheme + " }\n";
    const SceneResult parts = run_scene(c + diffusion("time 0 .. 1/16, step 1/512; subcycle u in 4"), "s");
    const SceneResult steps = run_scene(c + diffusion("time 0 .. 1/16, step 1/2048"), "s");
    ASSERT_FALSE(parts.state.empty() || steps.state.empty());
    for (std::size_t i = 0; i < steps.state.at("u").size(); ++i)
      EXPECT_NEAR(parts.state.at("u")[i], steps.state.at("u")[i], 1e-13) << scheme;
  }
}

/// The limit of Euler's method is D dt/h^2 = 1/2; with 3 substeps a step of 1.2 is three of 0.4.
TEST(Subcycle, MakesAStiffEquationStable) {
  const auto largest = [](int parts) {
    const SceneResult result =
        run_scene(fmt::format("model m {{ field u; field slow; dt(u) = lap(u) + 0*slow; dt(slow) = -slow }}\nscheme c "
                              "{{ time = euler }}\nscene s : m with c {{\n"
                              "  grid x = 0 .. 40, cells 40, periodic\n  initial u = if(x < 1, 1, 0)\n  initial slow = "
                              "1\n  time 0 .. 240, step 1.2\n  subcycle u in {}\n}}\n",
                              parts),
                  "s");
    double most = 0;
    for (const double u : result.state.at("u")) most = std::max(most, std::abs(u));
    return most;
  };
  EXPECT_GT(largest(1), 1e6);
  EXPECT_GT(largest(2), 1e3);
  EXPECT_LT(largest(3), 0.1);
}

/// Three speeds, moving walls, an equation of second order: a wave that advects two tracers.
TEST(Subcycle, DerivativesAreCertified) {
  const auto text = [](const std::string& cells, const std::string& scheme) {
    return "model wave { field p; dt(dt(p)) = lap(p) - 0.1*dt(p) }\n"
           "model heat { field c; coefficient p; param k; dt(c) = k*lap(c) - 0.3*dx(p)*dx(c) + sin(p) }\n"
           "model fire { field q; coefficient c; coefficient p; dt(q) = 40*(c - q)*(1 + p^2) + 0.01*lap(q) }\n"
           "scheme s { time = " +
           scheme +
           " }\n"
           "scene d : wave, heat, fire with s {\n  grid x = 0 .. 1, cells " +
           cells +
           "\n  grid y = 0 .. 1, cells 3, periodic\n"
           "  boundary p: x.low = sin(5*t), x.high = zero_gradient\n  boundary c: x.low = A*t, x.high = 1\n  boundary "
           "q: x = zero_gradient\n"
           "  k = 0.05\n  A = 2\n  initial p = cos(3*x)\n  initial dt(p) = 0\n  initial c = x\n  initial q = sin(6*y)\n"
           "  time 0 .. 0.25, step 1/32\n  subcycle c in 2\n  subcycle q in 4\n  every 1/8: c += 0.1*q\n}\n"
           "task t : d {\n  unknown initial p\n  unknown initial q\n  unknown k from 0.04\n  unknown A\n  minimise "
           "mean(q^2 + c^3 + p)\n}\n";
  };
  for (const std::string scheme : {"rk2", "verlet"}) {
    for (const std::string cells : {"1", "2", "9"}) {
      std::string with_param = text(cells, scheme);
      with_param.replace(with_param.find("param k;"), 8, "param k, A;");
      with_param.replace(with_param.find("k*lap(c)"), 8, "k*lap(c) + 0*A");
      SCOPED_TRACE(scheme + " " + cells);
      expect_certified(with_param, false);
    }
  }
}

TEST(Subcycle, SecondDerivativesAreCertified) {
  expect_certified(
      "model m {\n  field u, v\n  param q\n  dt(u) = -u*dx(u)\n  dt(v) = q*u*v + 0.1*lap(v) + mean(u*v)\n}\nscheme c { "
      "time = rk2 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 7, periodic\n  q = 0.3\n  initial u = sin(6*x)/4\n  initial v = "
      "cos(6*x)\n  time 0 .. 1/4, step 1/32\n  subcycle v in 3\n}\n"
      "task t : s {\n  unknown initial u\n  unknown q from 0.4\n  minimise mean(u^2 + v^3)\n}\n",
      true);
}

/// Velocities on faces, walls, and tracers with shorter steps.
TEST(Subcycle, OfWhatStaggeredVelocitiesCarry) {
  expect_certified(
      "model water { vector u on faces; field eta; dt(u) = -grad(eta); dt(eta) = -div(interpolate(1 + eta)*u) }\n"
      "model dye { field c; coefficient vector u on faces; dt(c) = -advect(u, c) + 0.01*lap(c) }\n"
      "scheme c { time = ssp_rk3 }\n"
      "scene s : water, dye with c {\n  grid x = 0 .. 1, cells 6\n  grid y = 0 .. 1, cells 5, periodic\n  boundary "
      "u.x: x = 0.1*sin(t)\n  boundary u.y: x = 0\n  boundary eta: x = zero_gradient\n"
      "  boundary c: x = 1\n  initial u = 0\n  initial eta = 0.1*cos(3*x)\n  initial c = 1 + sin(6*y)\n  time 0 .. "
      "1/4, step 1/32\n  subcycle c in 3\n}\n"
      "task t : s {\n  unknown initial eta\n  minimise mean(c^2)\n}\n",
      false);
}

/// The slow equation reads ghost cells of the fast one, which its substeps fill at their own times.
TEST(Subcycle, DerivativesWhereTheSlowReadsWallsOfTheFast) {
  for (const std::string scheme : {"euler", "rk4"}) {
    for (const std::string cells : {"1", "2", "7"}) {
      SCOPED_TRACE(scheme + " " + cells);
      expect_certified(
          "model m {\n  field u, v\n  param q\n  dt(u) = 0.1*dx(v)^2 + 0.02*(1 + v)^2*lap(u)*(1 + t)\n  dt(v) = "
          "q*cos(t)*u*dx(v) + "
          "(0.1 + t)*lap(v)\n}\nscheme c { time = " +
              scheme + " }\nscene s : m with c {\n  grid x = 0 .. 1, cells " + cells +
              "\n  grid y = 0 .. 1, cells 3, periodic\n  q = 0.3\n  boundary u: x = q*t\n  boundary v: x.low = "
              "sin(9*t), x.high = gradient(t)\n  initial u = 0.2 + sin(6*x)/4\n  initial v = cos(6*(x + y))\n  time 0 "
              ".. 1/16, step 1/128\n  subcycle v in 5\n}\ntask t : s {\n  unknown initial u\n  unknown initial v\n  "
              "unknown q from 0.4\n  minimise mean(u^2 + v^3)\n}\n",
          false);
    }
  }
}

/// Values of the slow field on a moving wall are those of the end of the step, not of a substep.
TEST(Subcycle, LeavesTheValuesOnWallsToTheSlow) {
  for (const std::string wall : {"A*t", "linear", "gradient(A*t)"}) {
    for (const int parts : {1, 2, 3}) {
      SCOPED_TRACE(fmt::format("{}, {} parts", wall, parts));
      const std::string text = fmt::format(
          "model w {{ field u on faces.x; field e; param A; dt(u) = 0; dt(e) = -dx(u) - 0.1*interpolate(u) }}\nscheme "
          "c {{ time = "
          "euler }}\nscene s : w with c {{\n  grid x = 0 .. 1, cells 4\n  A = 1\n  boundary u: x = {}\n  boundary e: "
          "x = zero_gradient\n  initial u = 0\n  initial e = 0\n  time 0 .. 1, step 1/4\n  subcycle e in {}\n}}\n"
          "task t : s {{ unknown A; unknown initial u; minimise mean(u^2) + mean(e^2) }}\n",
          wall, parts);
      const SceneResult result = run_scene(text, "s");
      ASSERT_EQ(result.state.count("u"), 1u);
      if (wall == "A*t") EXPECT_EQ(result.state.at("u"), (std::vector<double>{0, 0, 0, 1}));
      expect_certified(text, false);
    }
  }
}

}  // namespace
}  // namespace dpde::testing
