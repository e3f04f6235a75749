// SPDX-License-Identifier: Apache-2.0
// Flux through walls with a slope: div(k*grad(u)) with a coefficient field k, against u = exp(-t)*sin(2x + 0.3), k = 1
// + x^2/2 (section 2 of the table of references, with other walls).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::string rod(const std::string& boundary, const std::string& flux = "div(k*grad(u))",
                const std::string& scheme = "") {
  return "model m {\n  field u\n  coefficient k\n  dt(u) = " + flux +
         " - exp(-t)*(sin(2*x + 0.3) + 2*x*cos(2*x + 0.3) - 4*(1 + x^2/2)*sin(2*x + 0.3))\n}\n"
         "scheme c { time = rk4; " +
         scheme +
         " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 16\n  k = 1 + x^2/2\n"
         "  boundary u: " +
         boundary +
         "\n  initial u = sin(2*x + 0.3)\n  exact u = exp(-t)*sin(2*x + 0.3)\n"
         "  time 0 .. 1/4, step 1/16384\n}\n";
}

const std::string slope_low = "-2*exp(-t)*cos(0.3)", slope_high = "2*exp(-t)*cos(2.3)";

double order_of(const std::string& text, double& finest) {
  double before = 0, order = 0;
  for (const std::string cells : {"16", "32", "64"}) {
    const double error = run_scene(text, "s", {{"cells", cells}}).l2.at("u");
    if (before > 0) order = std::log2(before / error);
    before = error;
  }
  finest = before;
  return order;
}

/// With the cell value next to the wall the order was 1.
TEST(WallFlux, IsOfOrder2AtWallsWithSlopes) {
  const std::string value = "exp(-t)*sin(0.3)", mixed_high = "exp(-t)*(sin(2.3) + cos(2.3))";
  for (const std::string& boundary : {"x.low = gradient(" + slope_low + "), x.high = gradient(" + slope_high + ")",
                                      "x.low = " + value + ", x.high = mixed(1, 0.5, " + mixed_high + ")"}) {
    double finest = 0;
    EXPECT_NEAR(order_of(rod(boundary), finest), 2, 0.15) << boundary;
    EXPECT_LT(finest, 2e-4) << boundary;
  }
}

/// The note of `check` on higher orders between walls: mirrored values reduce the order to 2.
TEST(WallFlux, OfHigherOrdersIsOfOrder2BetweenWalls) {
  const std::string lap = "(1 + x^2/2)*lap(u) + x*dx(u)", scheme = "lap = central(4); dx = central(4)";
  double finest = 0;
  EXPECT_NEAR(order_of(rod("x.low = exp(-t)*sin(0.3), x.high = gradient(" + slope_high + ")", lap, scheme), finest), 2,
              0.3);
}

TEST(WallFlux, DerivativesByTheCoefficientAreCertified) {
  for (const std::string cells : {"1", "2", "3", "7"}) {
    for (const std::string scheme : {"", "dx = central(4)"}) {
      SCOPED_TRACE(cells + " " + scheme);
      expect_certified(
          "model m { field u; coefficient k; dt(u) = div(k*grad(u)) + dx(k)*u }\nscheme c { time = rk2; " + scheme +
              " }\nscene s : m with c {\n  grid x = 0 .. 1, cells " + cells +
              "\n  grid y = 0 .. 1, cells 4\n  k = 0.1 + 0.02*x\n  boundary u: x.low = gradient(0.3), "
              "x.high = mixed(1, 2, t), y = gradient(x)\n  initial u = x*y\n  time 0 .. 1/16, step 1/256\n}\n"
              "task t : s {\n  unknown k\n  minimise mean(u^3)\n}\n",
          cells == "7");
    }
  }
}

}  // namespace
}  // namespace dpde::testing
