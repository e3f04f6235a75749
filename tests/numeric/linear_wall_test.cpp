// SPDX-License-Identifier: Apache-2.0
// Outflow: ghost cells extrapolate the straight line through the two cells next to a side.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;
using testing::task_gradient;
using testing::task_loss;

/// A wave that moves to the right and leaves.
std::string leaving(const std::string& on, const std::string& out, const std::string& stretch = "") {
  return "model carry { field u" + on + "; dt(u) = -dx(u) }\nscheme s { time = rk4 }\nscene s : carry with s {\n" +
         "  grid x = 0 .. 1, cells 8" + stretch + "\n  boundary u: x.low = sin(-3*t), x.high = " + out +
         "\n  initial u = sin(3*x)\n  exact u = sin(3*(x - t))\n  time 0 .. 0.5, step 1/2048\n}\n";
}

double order(const std::string& text, int cells) {
  const auto error = [&](int n) { return run_scene(text, "s", {{"cells", std::to_string(n)}}).l2.at("u"); };
  return std::log2(error(cells) / error(2 * cells));
}

TEST(LinearWall, WhatLeavesIsOfOrderTwo) {
  const std::string stretch = ", stretched (exp(1.5*x) - 1)/(exp(1.5) - 1)";
  EXPECT_NEAR(order(leaving("", "linear"), 64), 2, 0.1);
  EXPECT_NEAR(order(leaving("", "linear", stretch), 64), 2, 0.15);
  EXPECT_NEAR(order(leaving(" on faces.x", "linear"), 64), 2, 0.1);
  EXPECT_LT(order(leaving("", "zero_gradient"), 64), 1.6);
}

/// u = 2 + x - t is exact for all operators, in any number of cells that can represent a line.
TEST(LinearWall, LinesAreExact) {
  const std::string line = R"(
model carry { field u; dt(u) = -dx(u) + 0.1*lap(u) }
scheme s { time = rk4; SCHEME }
scene s : carry with s {
  grid x = 0 .. 1, cells 8
  boundary u: x = linear
  initial u = 2 + x
  exact u = 2 + x - t
  time 0 .. 0.25, step 1/256
}
)";
  for (const char* scheme : {"", "advect = upwind(1)", "dx = central(4); lap = central(4)"}) {
    std::string text = line;
    text.replace(text.find("SCHEME"), 6, scheme);
    for (const char* cells : {"2", "3", "4", "9"})
      EXPECT_LT(run_scene(text, "s", {{"cells", cells}}).l2.at("u"), 1e-13) << scheme << " " << cells;
  }
}

/// A line in the position, also on stretched axes: diffusion leaves it unchanged, and nothing grows at the wall.
TEST(LinearWall, LinesStayOnStretchedAxes) {
  for (const std::string map : {"0.5 + 0.5*tanh(2*(2*x - 1))/tanh(2)", "x + 0.1*sin(2*pi*x)", "log(1 + 3*x)/log(4)"}) {
    for (const std::string word : {"linear", "outflow"}) {
      const std::string text = "model m { field u; dt(u) = lap(u) }\nscheme s { time = backward_euler }\n" +
                               ("scene s : m with s {\n  grid x = 0 .. 1, cells 8, stretched " + map) +
                               "\n  boundary u: x.low = linear, x.high = " + word +
                               "\n  initial u = 1 + x\n  exact u = 1 + x\n  time 0 .. 1, step 1/64\n}\n";
      EXPECT_NEAR(order(text, 32), 2, 0.15) << map;
      EXPECT_LT(run_scene(text, "s", {{"cells", "64"}}).l2.at("u"), 5e-4) << map;
    }
  }
}

/// The loss is quadratic in A, so its difference is the derivative for any displacement.
TEST(LinearWall, GradientsAreExact) {
  const auto text = [](const std::string& a, const std::string& cells, const std::string& sides) {
    return "model m { field u; param A; dt(u) = 0.05*lap(u) - dx(u) }\nscheme s { time = rk4; dx = central(4) }\n"
           "scene s : m with s {\n  grid x = 0 .. 1, cells " +
           cells + "\n  boundary u: " + sides + "\n  A = " + a +
           "\n  initial u = sin(3*x)\n  time 0 .. 0.2, step 0.02\n}\n"
           "task t : s {\n  unknown A from " +
           a + "\n  unknown initial u\n  minimise integral((u - 1)^2) + mean(dx(u)^2) over time\n}\n";
  };
  for (const char* cells : {"1", "2", "3", "7", "1, stretched (x + 0.5*x^2)/1.5", "2, stretched (x + 0.5*x^2)/1.5",
                            "7, stretched (x + 0.5*x^2)/1.5"}) {
    for (const char* sides : {"x.low = A, x.high = linear", "x.low = linear, x.high = gradient(A)",
                              "x.low = "
                              "mixed(1, 0.5, A), x.high = linear"}) {
      const auto here = task_gradient(text("0.4", cells, sides), "t");
      const double difference =
          (task_loss(text("1.4", cells, sides), "t") - task_loss(text("-0.6", cells, sides), "t")) / 2;
      EXPECT_NEAR(here.gradient.at("A")[0], difference, 1e-11 * (1 + std::abs(difference))) << cells << " " << sides;
    }
  }
}

}  // namespace
}  // namespace dpde
