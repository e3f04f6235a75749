// SPDX-License-Identifier: Apache-2.0
// Coefficients in boundary values: their value on the wall, to order 2; or the value of the cell there, if they have a
// value for each point of the wall. They may be unknowns.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::string heated_plate(const std::string& boundary, const std::string& cells = "6",
                         const std::string& y = "cells 5, periodic", const std::string& rest = "") {
  return "model m { field u; coefficient g, k; dt(u) = div(k*grad(u)) + g }\nscheme c { time = rk2 }\nscene s : m with "
         "c {\n"
         "  grid x = 0 .. 1, cells " +
         cells + "\n  grid y = 0 .. 1, " + y + "\n  g = cos(6.283185307179586*y)\n  k = 0.1 + 0.02*x\n" + boundary +
         "\n  initial u = x\n  time 0 .. 1/8, step 1/256\n" + rest + "}\n";
}

TEST(WallCoefficient, IsThatOfTheCellAtTheWall) {
  const std::string by_name = "  boundary u: x.low = g*t, x.high = gradient(2*g)";
  const std::string spelled =
      "  boundary u: x.low = cos(6.283185307179586*y)*t, x.high = gradient(2*cos(6.283185307179586*y))";
  const std::vector<double> named = run_scene(heated_plate(by_name), "s").state.at("u"),
                            written = run_scene(heated_plate(spelled), "s").state.at("u");
  ASSERT_EQ(named.size(), 30u);
  for (std::size_t i = 0; i < named.size(); ++i) EXPECT_NEAR(named[i], written[i], 1e-14);
}

/// The flux q through the walls of a rod with conductivity k, against u = exp(-t)*sin(2x + 0.3); and a value and a
/// mixed condition that vary across their walls. With the cell values next to the walls the order was 1.
std::string conducting_rod(const std::string& boundary) {
  return "model m {\n  field u\n  coefficient k, q, s\n  dt(u) = div(k*grad(u))\n"
         "    - exp(-t)*(sin(2*x + 0.3) + 2*x*cos(2*x + 0.3) - 4*(1 + x^2/2)*sin(2*x + 0.3))\n}\n"
         "scheme c { time = rk4 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 16\n  k = 1 + x^2/2\n"
         "  q = 2*(1 + x^2/2)*cos(2*x + 0.3)\n  s = sin(2*x + 0.3)\n  boundary u: " +
         boundary +
         "\n  initial u = sin(2*x + 0.3)\n  exact u = exp(-t)*sin(2*x + 0.3)\n  time 0 .. 1/8, step 1/4096\n}\n";
}

TEST(WallCoefficient, IsOfOrder2OnTheWall) {
  for (const char* boundary : {"x.low = gradient(-exp(-t)*q/k), x.high = gradient(exp(-t)*q/k)",
                               "x.low = exp(-t)*s, x.high = mixed(1, 0.5, exp(-t)*(s + 0.5*q/k))",
                               "x.low = gradient(u - exp(-t)*(s + q/k)), x.high = exp(-t)*s"}) {
    const double coarse = run_scene(conducting_rod(boundary), "s", {{"cells", "16"}}).l2.at("u"),
                 fine = run_scene(conducting_rod(boundary), "s", {{"cells", "32"}}).l2.at("u");
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.2) << boundary;
    EXPECT_LT(fine, 1e-3) << boundary;
  }
}

/// A coefficient that no equation reads and whose formula is constant across the wall has a value for each point of it.
TEST(WallCoefficient, ThatNothingElseReadsHasAValueForEachPlace) {
  const std::string text =
      "model m { field u; coefficient g; dt(u) = lap(u) }\nscheme c { time = rk2 }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 4\n  grid y = 0 .. 1, cells 3, periodic\n  g = y\n"
      "  boundary u: x.low = g, x.high = zero_gradient\n  initial u = 0\n  time 0 .. 1/8, step 1/64\n}\n"
      "task t : s {\n  unknown g\n  minimise mean((u - 1)^2)\n}\n";
  const std::vector<double> gradient = task_gradient(text, "t").gradient.at("g");
  ASSERT_EQ(gradient.size(), 12u);
  for (std::size_t i = 0; i < gradient.size(); ++i) EXPECT_EQ(gradient[i] == 0, i % 4 != 0) << i;
}

TEST(WallCoefficient, TheInterpreterAgrees) {
  const std::string text =
      heated_plate("  boundary u: x.low = g*(1 + t), x.high = gradient(k*g), y = mixed(1, 1, k*g)", "5", "cells 4");
  const auto jit = run_scene(text, "s").state.at("u");
  const auto values = run_scene(text, "s", {}, driver::Backend::interpreter).state.at("u");
  for (std::size_t i = 0; i < jit.size(); ++i) EXPECT_NEAR(jit[i], values[i], 1e-13);
}

TEST(WallCoefficient, DerivativesAreCertified) {
  for (const std::string cells : {"1", "2", "7"}) {
    for (const std::string y : {"cells 5, periodic", "cells 1", "cells 4"}) {
      const std::string ends = y == "cells 5, periodic" ? "" : ", y.low = g^2, y.high = mixed(1, 1, k*g)";
      SCOPED_TRACE(cells + " " + y);
      expect_certified(heated_plate("  boundary u: x.low = g*(1 + t), x.high = gradient(k*g)" + ends, cells, y) +
                           "task t : s {\n  unknown g from 0.5\n  unknown k\n  minimise mean(u^3)\n}\n",
                       cells == "2");
    }
  }
}

/// The last velocities on faces lie on the wall: they are g extrapolated linearly to it.
TEST(WallCoefficient, OfStaggeredWallsIsOfOrder2) {
  const auto error = [](const std::string& cells) {
    const std::string text =
        "model m { vector u on faces; coefficient g; dt(u) = 0.1*lap(u) }\nscheme c { time = rk2 }\n"
        "scene s : m with c {\n  grid x = 0 .. 1, cells " +
        cells +
        "\n  grid y = 0 .. 1, cells 2, periodic\n  g = cos(2*x)\n  boundary u.x: x = g\n  boundary u.y: x = 0\n"
        "  initial u = 0\n  time 0 .. 1/64, step 1/1024\n}\n";
    return std::abs(run_scene(text, "s").state.at("u.x").back() - std::cos(2));
  };
  EXPECT_NEAR(std::log2(error("32") / error("64")), 2, 0.3);
}

/// The last velocities on faces lie on the walls and equal the coefficient there.
TEST(WallCoefficient, HoldsOnStaggeredWalls) {
  for (const char* g : {"0.1*cos(6*y)", "0.1*cos(6*y + x)"}) {
    SCOPED_TRACE(g);
    expect_certified(
        "model m { vector u on faces; field p; coefficient g; dt(u) = -grad(p); dt(p) = -div(u) }\n"
        "scheme c { time = rk2 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 5\n"
        "  grid y = 0 .. 1, cells 4\n  g = " +
            std::string(g) +
            "\n  boundary u.x: x.low = g*t, x.high = -g, y = g\n  boundary u.y: x = gradient(g), y = 0\n"
            "  boundary p: all = zero_gradient\n  initial u = 0\n  initial p = x\n  time 0 .. 1/8, step 1/64\n}\n"
            "task t : s {\n  unknown g\n  minimise mean(p^2 + lap(u.x)^2)\n}\n",
        false);
  }
}

TEST(WallCoefficient, MayNotBeADerivative) {
  const SourceFile source("test.dpde", heated_plate("  boundary u: x = dx(u)"));
  DiagnosticSink sink;
  EXPECT_FALSE(driver::compile(source, {}, sink));
  ASSERT_FALSE(sink.all().empty());
  EXPECT_EQ(sink.all().front().kind->code, "E0311");
}

}  // namespace
}  // namespace dpde::testing
