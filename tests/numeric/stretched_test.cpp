// SPDX-License-Identifier: Apache-2.0
// Stretched axes: orders of every scheme against exact solutions, conservation and means, the gain near walls, and
// gradients of quadratic losses against differences, which are exact up to rounding for any displacement.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;
using testing::task_gradient;
using testing::task_loss;

const std::string to_the_low_wall = ", stretched (exp(1.5*x) - 1)/(exp(1.5) - 1)\n";  // 0 .. 1, widths 1 : 4.5
const std::string to_both_walls =
    ", stretched 0.5 + 0.5*tanh(1.5*(2*y - 1))/tanh(1.5)\n";          // 0 .. 1, widths 1 : 5.5 : 1
const std::string around = ", periodic, stretched x + 0.4*sin(x)\n";  // 0 .. 2*pi

const std::string central_with_rk4 =
    "scheme s { advect = central(2); dx = central(2); lap = central(2); time = rk4 }\n";

/// 1/count as a setting.
std::string part_of_one(int count) { return "1/" + std::to_string(count); }

double order_by_refinement(const std::string& text, int cells, const Overrides& more = {}, bool refines_step = false) {
  const auto error = [&](int refinement) {
    Overrides overrides = more;
    overrides["cells"] = std::to_string(cells * refinement);
    if (refines_step) overrides["step"] = part_of_one(cells * refinement);
    return run_scene(text, "s", overrides).l2.at("u");
  };
  const double coarse = error(1), fine = error(2);
  EXPECT_GT(fine, 1e-12) << text;
  return std::log2(coarse / fine);
}

/// Values, given derivatives and mixed conditions that vary in time, at walls with narrow and wide cells.
TEST(Stretched, ConditionsAtWallsAreOfOrderTwo) {
  const std::string heat = "model heat { field u; param kappa; dt(u) = kappa*lap(u) }\n" + central_with_rk4 +
                           "scene s : heat with s {\n  grid x = 0 .. 1, cells 8" + to_the_low_wall +
                           "  kappa = 0.5\n  initial u = sin(x + 0.2)\n  exact u = exp(-kappa*t)*sin(x + 0.2)\n  time "
                           "0 .. 0.25, step 1/16384\n";
  const std::string low_value = "x.low = exp(-kappa*t)*sin(0.2)", high_value = "x.high = exp(-kappa*t)*sin(x + 0.2)";
  const std::string low_slope = "x.low = gradient(-exp(-kappa*t)*cos(0.2))",
                    high_slope = "x.high = gradient(exp(-kappa*t)*cos(1.2))";
  const std::string low_mixed = "x.low = mixed(1, 0.5, exp(-kappa*t)*(sin(0.2) - 0.5*cos(0.2)))";
  const std::string high_mixed = "x.high = mixed(2, 3 + t, exp(-kappa*t)*(2*sin(1.2) + (3 + t)*cos(1.2)))";
  for (const std::string& low : {low_value, low_slope, low_mixed}) {
    for (const std::string& high : {high_value, high_slope, high_mixed}) {
      const std::string text = heat + "  boundary u: " + low + ", " + high + "\n}\n";
      EXPECT_NEAR(order_by_refinement(text, 16), 2, 0.15) << low << ", " << high;
    }
  }
}

/// A manufactured solution of div(kappa*grad(u)) with a variable coefficient kappa, in two dimensions: one axis of each
/// kind.
TEST(Stretched, DiffusionOfVaryingStrengthIsOfOrderTwo) {
  const std::string text = R"(
model m {
  field u
  coefficient kappa
  let e = exp(-t)
  dt(u) = div(kappa*grad(u)) - e*cos(x)*(1 + y^2) + e*(2 + sin(x))*cos(x)*(1 + y^2) + e*cos(x)*sin(x)*(1 + y^2) - 2*e*(2 + sin(x))*cos(x)
}
)" + central_with_rk4 + R"(
scene s : m with s {
  grid x = 0 .. 2*pi, cells 16)" +
                           around + R"(
  grid y = 0 .. 1, cells 16)" +
                           to_both_walls + R"(
  kappa = 2 + sin(x)
  boundary u: y.low = zero_gradient, y.high = 2*exp(-t)*cos(x)
  initial u = cos(x)*(1 + y^2)
  exact u = exp(-t)*cos(x)*(1 + y^2)
  time 0 .. 1/64, step 1/131072
}
)";
  EXPECT_NEAR(order_by_refinement(text, 16), 2, 0.1);
}

const std::string ring = R"(
model m { field u; param c; dt(u) = -advect(c, u) }
)" + central_with_rk4 + R"(
scene s : m with s {
  grid x = 0 .. 2*pi, cells 32)" +
                         around + R"(  c = 1
  initial u = sin(x) + 0.3*cos(2*x)
  exact u = sin(x - c*t) + 0.3*cos(2*(x - c*t))
  time 0 .. 1, step 1/1024
}
)";

TEST(Stretched, TransportIsOfTheOrderOfItsScheme) {
  EXPECT_NEAR(order_by_refinement(ring, 64), 2, 0.1);
  EXPECT_NEAR(order_by_refinement(ring, 64, {{"advect", "central(4)"}}), 4, 0.15);
  EXPECT_NEAR(order_by_refinement(ring, 128, {{"advect", "upwind(1)"}}), 1, 0.15);
  EXPECT_NEAR(order_by_refinement(ring, 64, {{"advect", "upwind(3)"}}), 3, 0.15);
  EXPECT_NEAR(order_by_refinement(ring, 256, {{"advect", "semi_lagrangian"}, {"time", "euler"}}, true), 1, 0.15);
}

TEST(Stretched, HigherOrdersHoldOnPeriodicAxes) {
  const std::string text = "model m { field u; param k; dt(u) = k*lap(u) - dx(u) }\n" + central_with_rk4 +
                           "scene s : m with s {\n  grid x = 0 .. 2*pi, cells 32" + around + R"(  k = 0.1
  initial u = sin(x) + 0.3*cos(2*x)
  exact u = exp(-k*t)*sin(x - t) + 0.3*exp(-4*k*t)*cos(2*(x - t))
  time 0 .. 0.5, step 1/1024
}
)";
  EXPECT_NEAR(order_by_refinement(text, 64), 2, 0.1);
  EXPECT_NEAR(order_by_refinement(text, 64, {{"dx", "central(4)"}}), 4, 0.15);
  EXPECT_NEAR(order_by_refinement(text, 32, {{"dx", "central(6)"}}), 6, 0.3);
}

/// The third derivative is the first of a second derivative; also between walls.
TEST(Stretched, DerivativesOfHighOrderAreNested) {
  const std::string third = "model m { field u; dt(u) = -d(u, x, 3) }\n" + central_with_rk4 +
                            "scene s : m with s {\n  grid x = 0 .. 2*pi, cells 32" + around + R"(
  initial u = sin(x)
  exact u = sin(x + t)
  time 0 .. 0.015625, step 1/16384
}
)";
  EXPECT_NEAR(order_by_refinement(third, 32), 2, 0.1);
}

/// The speeds of upwinding and of a Courant number are physical, not in the uniform coordinate.
TEST(Stretched, CourantStepsLookAtTheNarrowestCell) {
  std::string text = ring;
  text.replace(text.find("step 1/1024"), 11, "step 1, courant 0.5");
  EXPECT_NEAR(order_by_refinement(text, 64), 2, 0.1);
  // a step of 1 with the number of substeps for 0.5 of the narrowest cell: 1/(0.5*h*0.6), h the width in the uniform
  // coordinate
  Overrides parts{{"cells", "64"}};
  const double with_parts = run_scene(text, "s", parts).l2.at("u");
  const double narrowest = 2 * M_PI / 64 * (1 - 0.4 * std::cos(M_PI / 64));
  const int count = static_cast<int>(std::ceil(1 / (0.5 * narrowest)));
  const double whole = run_scene(ring, "s", {{"cells", "64"}, {"step", part_of_one(count)}}).l2.at("u");
  EXPECT_NEAR(with_parts, whole, 1e-9 * whole);
}

const std::string stretched_basin = R"(
model m { field u; param k; dt(u) = div((k + u^2)*grad(u)) }
)" + central_with_rk4 + R"(
scene s : m with s {
  grid x = 0 .. 1, cells 13)" + to_the_low_wall +
                                    R"(  grid y = 0 .. 1, cells 9)" + to_both_walls + R"(  k = 0.1
  boundary u = zero_gradient
  initial u = 1 + 0.5*cos(3*x)*sin(2*y)
  time 0 .. 0.1, step 1/10000
}
task total : s { unknown initial u; minimise integral(u) }
task before : s { unknown initial u; minimise integral(u) at t = 0 }
task one : s { unknown initial u from 1; minimise mean(u) at t = 0 }
task all : s { unknown initial u from 1; minimise integral(u) at t = 0 }
)";

TEST(Stretched, WhatFlowsInFluxFormIsConserved) {
  const double before = task_loss(stretched_basin, "before"), after = task_loss(stretched_basin, "total");
  EXPECT_NEAR(after, before, 1e-13 * before);
  EXPECT_GT(std::abs(before - 1), 1e-2);
  // the gradient of the final total by each initial cell value is the cell volume
  const auto volumes = task_gradient(stretched_basin, "all").gradient.at("u"),
             kept = task_gradient(stretched_basin, "total").gradient.at("u");
  for (std::size_t i = 0; i < volumes.size(); ++i) EXPECT_NEAR(kept[i], volumes[i], 1e-13) << i;
}

TEST(Stretched, MeansWeighCellsByTheirVolume) {
  EXPECT_NEAR(task_loss(stretched_basin, "one"), 1, 4e-16);
  EXPECT_NEAR(task_loss(stretched_basin, "all"), 1, 4e-16);
  for (const char* cells : {"1", "2", "3", "7"})
    EXPECT_NEAR(task_loss(stretched_basin, "one", {{"cells", cells}}), 1, 4e-16) << cells;
  // integral(x^2) is 1/3 to the order of the midpoint rule
  std::string text = stretched_basin;
  text.replace(text.find("from 1; minimise integral(u)"), 28, "from x^2; minimise integral(u)");
  const double coarse = task_loss(text, "all", {{"cells", "16"}}) - 1.0 / 3,
               fine = task_loss(text, "all", {{"cells", "32"}}) - 1.0 / 3;
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.1);
  EXPECT_LT(std::abs(fine), 1e-3);
}

/// Also in equations and along one axis: x relaxes to its mean, a field uniform in x stays as it is.
TEST(Stretched, ReductionsInEquationsWeighCells) {
  const auto text = [](const std::string& initial, const std::string& exact) {
    return "model m { field u; dt(u) = 0.5*(mean(u, x) + integral(u, x)) - u }\n" + central_with_rk4 +
           "scene s : m with s {\n  grid x = 0 .. 1, cells 16" + to_the_low_wall +
           "  grid y = 0 .. 1, cells 3\n  boundary u = zero_gradient\n  initial u = " + initial +
           "\n  exact u = " + exact + "\n  time 0 .. 1, step 1/64\n}\n";
  };
  EXPECT_LT(run_scene(text("1 + y", "1 + y"), "s").l2.at("u"), 1e-14);
  EXPECT_NEAR(order_by_refinement(text("x", "0.5 + (x - 0.5)*exp(-t)"), 16), 2, 0.1);
}

/// A prescribed flux passes a wall unchanged, whatever the cells: the total grows by kappa*g in unit time, in the
/// measure with the exact length of the axis.
TEST(Stretched, GivenFluxesPassWallsExactly) {
  const std::string text =
      "model m { field u; dt(u) = 0.5*lap(u) }\n" + central_with_rk4 +
      "scene s : m with s {\n  grid x = 0 .. 1, cells 7" + to_the_low_wall +
      "  boundary u: x.low = gradient(0.3), x.high = gradient(-0.1)\n  initial u = 1\n  time 0 .. 0.5, step 1/1000\n}\n"
      "task total : s { unknown initial u from 1; minimise integral(u) }\n";
  double length = 0;
  for (int i = 0; i < 7; ++i) length += 1.5 * std::exp(1.5 * (i + 0.5) / 7) / (std::exp(1.5) - 1) / 7;
  EXPECT_NEAR(length, 1, 0.01);
  EXPECT_NEAR(task_loss(text, "total"), 1 + 0.5 * 0.5 * (0.3 - 0.1) / length, 1e-13);
}

/// Steady flow towards a wall: (exp((x - 1)/eps) - exp(-1/eps))/(1 - exp(-1/eps)).
TEST(Stretched, BoundaryLayersGainFromNarrowCells) {
  const auto text = [](const std::string& grid) {
    return "model m { field u; param eps; dt(u) = eps*lap(u) - dx(u) }\n" + central_with_rk4 +
           "scene s : m with s {\n  grid x = 0 .. 1, cells 32" + grid + R"(
  eps = 0.05
  boundary u: x.low = 0, x.high = 1
  initial u = (exp((x - 1)/eps) - exp(-1/eps))/(1 - exp(-1/eps))
  exact u = (exp((x - 1)/eps) - exp(-1/eps))/(1 - exp(-1/eps))
  time 0 .. 2, step 1/8192
}
)";
  };
  const double uniform = run_scene(text(""), "s").l2.at("u"),
               stretched = run_scene(text(", stretched tanh(1.7*x)/tanh(1.7)"), "s").l2.at("u");
  RecordProperty("uniform over stretched", std::to_string(uniform / stretched));
  EXPECT_GT(uniform / stretched, 4) << uniform << " " << stretched;
}

/// A loss quadratic in the unknown A, and in a cell of the field: (L(A+1) - L(A-1))/2 is its derivative.
TEST(Stretched, GradientsAreExact) {
  const auto text = [](const std::string& value, const std::string& cells, const std::string& schemes,
                       const std::string& sides) {
    return "model m { field u; param A; coefficient w; dt(u) = 0.01*lap(u) - dx(u) + w }\nscheme s { " + schemes +
           " }\nscene s : m with s {\n  grid x = 0 .. 1, cells " + cells + to_the_low_wall + "  boundary u: " + sides +
           "\n  A = " + value + "\n  w = A*x\n  initial u = sin(3*x)\n  time 0 .. 0.05, step 0.01\n}\n" +
           "task t : s {\n  unknown A from " + value +
           "\n  unknown initial u\n  minimise integral((u - 1)^2) + 0.1*mean(dx(u)^2) over time\n}\n";
  };
  for (const char* cells : {"1", "2", "5"}) {
    for (const char* schemes : {"time = euler; advect = upwind(1)", "time = rk2; dx = central(4)"}) {
      for (const char* sides :
           {"x.low = A, x.high = zero_gradient", "x.low = gradient(A), x.high = mixed(1, 0.5, A)"}) {
        const auto gradient = task_gradient(text("0.4", cells, schemes, sides), "t").gradient;
        const double difference =
            (task_loss(text("1.4", cells, schemes, sides), "t") - task_loss(text("-0.6", cells, schemes, sides), "t")) /
            2;
        EXPECT_NEAR(gradient.at("A")[0], difference, 1e-11 * (1 + std::abs(difference))) << cells << schemes << sides;
        EXPECT_GT(std::abs(difference), 1e-5);
      }
    }
  }
}

/// Waves on a staggered grid: velocities on faces between stretched cells, and on the walls themselves.
TEST(Stretched, StaggeredWavesAreOfOrderTwo) {
  const std::string text = R"(
model water { vector v on faces; field u; dt(u) = -div(v); dt(v) = -grad(u) }
)" + central_with_rk4 + R"(
scene s : water with s {
  grid x = 0 .. 1, cells 16)" +
                           to_the_low_wall + R"(  grid y = 0 .. 1, cells 16)" + to_both_walls + R"(
  boundary v = 0
  boundary u = zero_gradient
  initial v = (0, 0)
  initial u = cos(pi*x)*cos(2*pi*y)
  exact u = cos(pi*x)*cos(2*pi*y)*cos(sqrt(5)*pi*t)
  exact v.x = sin(pi*x)*cos(2*pi*y)*sin(sqrt(5)*pi*t)/sqrt(5)
  exact v.y = 2*cos(pi*x)*sin(2*pi*y)*sin(sqrt(5)*pi*t)/sqrt(5)
  time 0 .. 0.25, step 1/1024
}
task total : s { unknown initial u; minimise integral(u) }
task before : s { unknown initial u; minimise integral(u) at t = 0 }
)";
  EXPECT_NEAR(order_by_refinement(text, 16), 2, 0.15);
  const auto coarse = run_scene(text, "s", {{"cells", "16"}}).l2, fine = run_scene(text, "s", {{"cells", "32"}}).l2;
  for (const char* field : {"v.x", "v.y"}) EXPECT_NEAR(std::log2(coarse.at(field) / fine.at(field)), 2, 0.15) << field;
  EXPECT_NEAR(task_loss(text, "total"), task_loss(text, "before"), 1e-14);
}

}  // namespace
}  // namespace dpde
