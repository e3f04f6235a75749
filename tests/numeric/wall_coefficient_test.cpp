// SPDX-License-Identifier: Apache-2.0
// Coefficients in boundary values: they are those of the cells at the wall, and may be sought.
#include <gtest/gtest.h>

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

/// Velocities on faces: their last values lie on the walls, and are what the coefficient says there.
TEST(WallCoefficient, HoldsOnStaggeredWalls) {
  expect_certified(
      "model m { vector u on faces; field p; coefficient g; dt(u) = -grad(p); dt(p) = -div(u) }\nscheme c { time = rk2 "
      "}\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 1, cells 4, periodic\n  g = 0.1*cos(6*y)\n  boundary u.x: x.low = "
      "g*t, x.high = -g\n  boundary u.y: x = 0\n"
      "  boundary p: x = zero_gradient\n  initial u = 0\n  initial p = x\n  time 0 .. 1/8, step 1/64\n}\ntask t : s "
      "{\n  unknown g\n  minimise mean(p^2)\n}\n",
      false);
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
