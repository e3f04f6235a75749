// SPDX-License-Identifier: Apache-2.0
// Every kind of boundary condition against closed forms: order 2, and gradients of quadratic losses against
// differences, which are exact up to rounding for any displacement.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::task_gradient;
using testing::task_loss;

const std::string heat = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) }
scheme s { lap = central(2); time = rk4 }
)";

/// Prescribed derivatives that vary in time, outward: -u_x at the low end.
const std::string flux = heat + R"(
scene s : heat with s {
  grid x = 0.2 .. 1.2, cells 8
  kappa = 0.5
  boundary u: x.low = gradient(-exp(-kappa*t)*cos(0.2)), x.high = gradient(exp(-kappa*t)*cos(x))
  initial u = sin(x)
  exact   u = exp(-kappa*t)*sin(x)
  time 0 .. 0.5, step 1/1024
}
)";

/// Cooling of a slab with Biot number 1: the first root of mu*tan(mu) = 1.
const std::string biot = heat + R"(
scene s : heat with s {
  grid x = 0 .. 1, cells 8
  kappa = 1
  boundary u: x.low = zero_gradient, x.high = mixed(1, 1, 0)
  initial u = cos(0.860333589019379762*x)
  exact   u = exp(-kappa*0.860333589019379762^2*t)*cos(0.860333589019379762*x)
  time 0 .. 0.25, step 1/2048
}
)";

const std::string mixed = heat + R"(
scene s : heat with s {
  grid x = 0 .. 1, cells 8
  kappa = 0.5
  boundary u: x.low = mixed(1, 0.5, -0.5*exp(-kappa*t)), x.high = mixed(2, 3 + t, exp(-kappa*t)*(2*sin(x) + (3 + t)*cos(x)))
  initial u = sin(x)
  exact   u = exp(-kappa*t)*sin(x)
  time 0 .. 0.5, step 1/1024
}
)";

/// Values, derivatives and a mixed condition that vary along the walls and in time.
const std::string plate = heat + R"(
scene s : heat with s {
  grid x = 0.1 .. 1.1, cells 8
  grid y = 0.2 .. 1.2, cells 8
  kappa = 0.5
  boundary u: x.low = exp(-2*kappa*t)*sin(x)*cos(y), x.high = gradient(exp(-2*kappa*t)*cos(x)*cos(y))
  boundary u: y.low = gradient(exp(-2*kappa*t)*sin(x)*sin(y)), y.high = mixed(1, 2, exp(-2*kappa*t)*sin(x)*(cos(y) - 2*sin(y)))
  initial u = sin(x)*cos(y)
  exact   u = exp(-2*kappa*t)*sin(x)*cos(y)
  time 0 .. 0.25, step 1/2048
}
)";

const std::string block = heat + R"(
scene s : heat with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 1, cells 8
  grid z = 0 .. 1, cells 8
  kappa = 0.2
  boundary u: y = exp(-3*kappa*t)*sin(x)*cos(y + z), z.low = gradient(exp(-3*kappa*t)*sin(x)*sin(y + z)), z.high = exp(-3*kappa*t)*sin(x)*cos(y + z)
  initial u = sin(x)*cos(y + z)
  exact   u = exp(-3*kappa*t)*sin(x)*cos(y + z)
  time 0 .. 0.125, step 1/1024
}
)";

TEST(Boundaries, AreOfOrderTwo) {
  const std::pair<std::string, double> scenes[] = {
      {flux, 1e-4}, {biot, 1e-4}, {mixed, 1e-4}, {plate, 1e-4}, {block, 1e-3}};
  for (const auto& [text, bound] : scenes) {
    const double coarse = run_scene(text, "s", {{"cells", "16"}}).l2.at("u"),
                 fine = run_scene(text, "s", {{"cells", "32"}}).l2.at("u");
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.15) << text << coarse << " " << fine;
    EXPECT_LT(fine, bound);
  }
}

/// Boundary values are taken at the time of the stage: with a wall value equal to u(t), a field that depends only on
/// time stays exact up to the order of the scheme.
TEST(Boundaries, StagesTakeValuesAtTheirTime) {
  const std::string text = R"(
model rise { field u; dt(u) = lap(u) + cos(t) }
scheme s { time = rk4 }
scene s : rise with s {
  grid x = 0 .. 4, cells 4
  boundary u: x = sin(t)
  initial u = 0
  exact u = sin(t)
  time 0 .. 1, step 1/8
}
)";
  const double coarse = run_scene(text, "s", {{"step", "1/8"}}).l2.at("u"),
               fine = run_scene(text, "s", {{"step", "1/16"}}).l2.at("u");
  EXPECT_GT(std::log2(coarse / fine), 1.85) << coarse << " " << fine;
  EXPECT_LT(fine, 1e-3);
}

/// A loss that is quadratic in the unknown `A`: (L(A+1) - L(A-1))/2 is its derivative.
void expect_gradient(const std::string& sides, const std::string& grid, const std::string& scheme) {
  const auto text = [&](const std::string& value) {
    return "model m { field u; param A, B; dt(u) = 0.05*lap(u) - dx(u) }\nscheme s { " + scheme +
           " }\nscene s : m with s {\n" + grid + "\nboundary u: " + sides + "\nA = " + value +
           "\nB = 0.7\ninitial u = sin(3*x)\ntime 0 .. 0.2, step 0.02\n}\n" + "task t : s {\nunknown A from " + value +
           "\nunknown B from 0.7\nunknown initial u\n" + "minimise integral((u - 1)^2) + mean(dx(u)^2) over time\n}\n";
  };
  const auto here = task_gradient(text("0.4"), "t");
  const double difference = (task_loss(text("1.4"), "t") - task_loss(text("-0.6"), "t")) / 2;
  EXPECT_NEAR(here.gradient.at("A")[0], difference, 1e-11 * (1 + std::abs(difference))) << text("0.4");
  EXPECT_GT(std::abs(difference), 5e-5);
}

TEST(Boundaries, UnknownsInTheirValuesHaveExactGradients) {
  for (const char* cells : {"1", "2", "3", "7"}) {
    const std::string line = std::string("grid x = 0 .. 1, cells ") + cells;
    for (const char* scheme : {"time = euler; advect = upwind(1)", "time = rk4; lap = central(4); dx = central(4)"}) {
      expect_gradient("x.low = A*sin(t + 1) + B^2, x.high = zero_gradient", line, scheme);
      expect_gradient("x.low = B, x.high = gradient(A*B)", line, scheme);
      expect_gradient("x.low = gradient(A + t), x.high = mixed(1, 0.5, A*B)", line, scheme);
    }
    const std::string plane = line + "\ngrid y = 0 .. 1, cells 3";
    expect_gradient("x.low = A*y, x.high = A, y = gradient(A*x)", plane, "time = rk2");
    expect_gradient("x = A*sin(y)", line + "\ngrid y = 0 .. 1, cells 3, periodic", "time = rk2");
  }
}

}  // namespace
}  // namespace dpde
