// SPDX-License-Identifier: Apache-2.0
// Staggered fields against closed forms: orders of the differences, values on walls, conservation.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;

/// Linear gravity waves, omega^2 = g*depth*k^2: standing between walls and in periodic basins, and travelling between
/// two walls that move with the water.
const std::string gravity_wave = R"(
model gravity_wave {
  vector u on faces
  field eta
  param g, depth
  dt(eta) = -depth*div(u)
  dt(u) = -g*grad(eta)
}
scheme s { dx = central(2); time = rk4 }
scene canal : gravity_wave with s {
  grid x = 0 .. 1, cells 16
  g = 2
  depth = 0.5
  boundary u = 0
  boundary eta = zero_gradient
  initial u = 0
  initial eta = cos(2*pi*x)
  exact eta = cos(2*pi*x)*cos(2*pi*t)
  exact u = 2*sin(2*pi*x)*sin(2*pi*t)
  time 0 .. 0.7, step 0.7/256
}
scene ring : gravity_wave with s {
  grid x = 0 .. 1, cells 16, periodic
  g = 2
  depth = 0.5
  initial u = 0
  initial eta = cos(2*pi*x)
  exact eta = cos(2*pi*x)*cos(2*pi*t)
  exact u = 2*sin(2*pi*x)*sin(2*pi*t)
  time 0 .. 0.7, step 0.7/256
}
scene basin : gravity_wave with s {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 2, cells 8
  g = 1
  depth = 1
  boundary u.x: x = 0, y = zero_gradient
  boundary u.y: x = zero_gradient, y = 0
  boundary eta = zero_gradient
  initial u = (0, 0)
  initial eta = cos(pi*x)*cos(pi*y)
  exact eta = cos(pi*x)*cos(pi*y)*cos(pi*sqrt(2)*t)
  exact u = (sin(pi*x)*cos(pi*y)*sin(pi*sqrt(2)*t)/sqrt(2), cos(pi*x)*sin(pi*y)*sin(pi*sqrt(2)*t)/sqrt(2))
  time 0 .. 0.5, step 1/256
}
scene room : gravity_wave with s {
  grid x = 0 .. 1, cells 4
  grid y = 0 .. 1, cells 4
  grid z = 0 .. 2, cells 4, periodic
  g = 1
  depth = 1
  boundary u.x: x = 0, y = zero_gradient
  boundary u.y: x = zero_gradient, y = 0
  boundary u.z = zero_gradient
  boundary eta = zero_gradient
  initial u = (0, 0, 0)
  initial eta = cos(pi*x)*cos(pi*y)*sin(pi*z)
  exact eta = cos(pi*x)*cos(pi*y)*sin(pi*z)*cos(pi*sqrt(3)*t)
  time 0 .. 0.25, step 1/128
}
scene wave_maker : gravity_wave with s {
  grid x = 0 .. 1, cells 16
  g = 1
  depth = 1
  boundary u: x.low = sin(-5*t), x.high = sin(5*(1 - t))
  boundary eta = zero_gradient
  initial u = sin(5*x)
  initial eta = sin(5*x)
  exact u = sin(5*(x - t))
  exact eta = sin(5*(x - t))
  time 0 .. 0.5, step 1/512
}
)";

double order(const std::string& text, const std::string& scene, const std::string& field, int cells,
             const Overrides& more = {}) {
  Overrides coarse = more, fine = more;
  coarse["cells"] = std::to_string(cells);
  fine["cells"] = std::to_string(2 * cells);
  return std::log2(run_scene(text, scene, coarse).l2.at(field) / run_scene(text, scene, fine).l2.at(field));
}

TEST(Staggered, GravityWavesAreOfOrder2BetweenWalls) {
  for (const char* field : {"eta", "u.x"}) EXPECT_NEAR(order(gravity_wave, "canal", field, 16), 2, 0.05) << field;
  for (const char* field : {"eta", "u.x", "u.y"})
    EXPECT_NEAR(order(gravity_wave, "basin", field, 16), 2, 0.05) << field;
  EXPECT_NEAR(order(gravity_wave, "room", "eta", 8), 2, 0.05);
}

TEST(Staggered, PeriodicGravityWavesAreOfTheOrderOfTheScheme) {
  for (const char* field : {"eta", "u.x"}) {
    EXPECT_NEAR(order(gravity_wave, "ring", field, 16), 2, 0.05) << field;
    EXPECT_NEAR(order(gravity_wave, "ring", field, 8, {{"dx", "central(4)"}}), 4, 0.1) << field;
    EXPECT_NEAR(order(gravity_wave, "ring", field, 8, {{"dx", "central(6)"}}), 6, 0.3) << field;
  }
}

/// Every stage of a step uses the walls at its own time; at the high wall this is the stored value itself.
TEST(Staggered, WallsMayMove) {
  for (const char* time : {"euler", "rk2", "rk4", "ssp_rk3", "ab2"}) {
    const Overrides set{{"time", time}, {"step", "1/32768"}};
    const bool first_order = std::string(time) == "euler";
    EXPECT_NEAR(order(gravity_wave, "wave_maker", "u.x", 16, set), 2, first_order ? 0.2 : 0.1) << time;
  }
  const auto end = run_scene(gravity_wave, "wave_maker").state.at("u.x");
  EXPECT_NEAR(end.back(), std::sin(5 * 0.5), 1e-14);
}

TEST(Staggered, BackEndsAgree) {
  for (const char* scene : {"canal", "basin", "wave_maker"}) {
    const Overrides set{{"end", "0.0625"}, {"step", "1/128"}, {"cells", "5"}};
    const auto wanted = run_scene(gravity_wave, scene, set, driver::Backend::interpreter).state;
    for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
      const auto got = run_scene(gravity_wave, scene, set, backend).state;
      for (const auto& [field, values] : wanted) {
        for (std::size_t i = 0; i < values.size(); ++i)
          EXPECT_NEAR(got.at(field)[i], values[i], 1e-13) << scene << " " << field << " " << i;
      }
    }
  }
}

/// x^2 - y^2 is a steady state of the five-point Laplacian, also at nodes: values that vary along walls on which nodes
/// lie are exact up to rounding.
TEST(Staggered, NodesLieOnTheWalls) {
  const std::string text = R"(
model m { field w on nodes; dt(w) = lap(w) }
scheme s { lap = central(2); time = rk4 }
scene s : m with s {
  grid x = 0 .. 1, cells 7
  grid y = 0 .. 1, cells 5
  boundary w: x.low = -y^2, x.high = 1 - y^2, y.low = x^2, y.high = x^2 - 1
  initial w = x^2 - y^2
  exact w = x^2 - y^2
  time 0 .. 0.1, step 1/1000
}
scene decay : m with s {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 1, cells 8
  boundary w = 0
  initial w = sin(pi*x)*sin(2*pi*y)
  exact w = exp(-5*pi^2*t)*sin(pi*x)*sin(2*pi*y)
  time 0 .. 0.04, step 0.04/512
}
)";
  EXPECT_LT(run_scene(text, "s").l2.at("w"), 1e-14);
  EXPECT_NEAR(order(text, "decay", "w", 8), 2, 0.05);
}

/// Products of fields at different placements, each interpolated; advection of staggered velocities by themselves.
TEST(Staggered, NonlinearTermsAreOfTheOrderOfTheScheme) {
  // Manufactured in one dimension: u = 2 + sin(x - t), c = cos(x - t), with the terms that make these a solution.
  const std::string manufactured = R"(
model m {
  field u on faces.x
  field c
  let s = sin(x - t)
  let k = cos(x - t)
  dt(u) = -advect(u, u) - interpolate(c)*dx(c) + dx(c^2) - k + (2 + s)*k + k*s
  dt(c) = -dx(interpolate(c)*u) - advect(u, c) + s + k*k - s*(2 + s) - (2 + s)*s
}
scheme s { dx = central(2); advect = central(2); time = rk4 }
scene ring : m with s {
  grid x = 0 .. 2*pi, cells 16, periodic
  initial u = 2 + sin(x)
  initial c = cos(x)
  exact u = 2 + sin(x - t)
  exact c = cos(x - t)
  time 0 .. 0.5, step 1/512
}
)";
  for (const char* field : {"u", "c"}) {
    EXPECT_NEAR(order(manufactured, "ring", field, 32), 2, 0.1) << field;
    EXPECT_NEAR(order(manufactured, "ring", field, 32, {{"dx", "central(4)"}, {"advect", "central(4)"}}), 4, 0.15)
        << field;
    EXPECT_NEAR(order(manufactured, "ring", field, 32, {{"advect", "upwind(1)"}}), 1, 0.15) << field;
  }
}

const std::string basin = R"( : shallow_water with s {
  grid x = 0 .. 1, cells 13
  grid y = 0 .. 1, cells 9
  g = 1
  f = 2
  depth = 1 + 0.3*x - 0.2*y
  boundary u.x: x = 0, y = zero_gradient
  boundary u.y: x = zero_gradient, y = 0
  boundary eta = zero_gradient
  initial u = (0, 0)
)";

const std::string shallow_water = R"(
model shallow_water {
  vector u on faces
  field eta
  coefficient depth
  param g, f
  dt(eta) = -div(interpolate(depth + eta)*u)
  dt(u.x) = -advect(u, u.x) - g*dx(eta) + f*interpolate(u.y)
  dt(u.y) = -advect(u, u.y) - g*dy(eta) - f*interpolate(u.x)
}
scheme s { dx = central(2); advect = central(2); time = rk4 }
scene lake)" + basin + R"(  initial eta = 0.2*exp(-20*((x - 0.4)^2 + (y - 0.6)^2))
  time 0 .. 2, step 1/100
}
scene rest)" + basin + R"(  initial eta = 0
  time 0 .. 1, step 1/100
}
scene jet : shallow_water with s {
  grid x = 0 .. 2*pi, cells 16, periodic
  grid y = 0 .. 1, cells 4, periodic
  g = 1
  f = 2
  depth = 1
  initial u = (0, -0.05*sin(x))
  initial eta = 0.1*cos(x)
  exact u = (0, -0.05*sin(x))
  exact eta = 0.1*cos(x)
  time 0 .. 1, step 1/100
}
)";

TEST(Staggered, WaterIsConservedBetweenWalls) {
  const auto end = run_scene(shallow_water, "lake").state;
  const auto start = run_scene(shallow_water, "lake", {{"end", "0.01"}}).state;
  const auto total = [](const std::vector<double>& eta) { return std::accumulate(eta.begin(), eta.end(), 0.0); };
  EXPECT_NEAR(total(end.at("eta")), total(start.at("eta")), 1e-13 * std::abs(total(start.at("eta"))) * 200);
  EXPECT_GT(std::abs(end.at("u.x")[60]), 1e-3);
}

TEST(Staggered, ALakeAtRestStaysAtRest) {
  for (const auto& [field, values] : run_scene(shallow_water, "rest").state) {
    for (const double value : values) EXPECT_EQ(value, 0) << field;
  }
}

/// Stoker's dam break from depth 2 to 1 with g = 1: between wave and shock the depth is 1.453840892 and the speed
/// 0.416920631.
TEST(Staggered, DamBreakHasStokersMiddleState) {
  const std::string text = testing::read_file(DPDE_SOURCE_DIR "/dsl-examples/shallow_water/shallow_water.dpde");
  const auto end = run_scene(text, "break").state;
  const std::size_t cell = 460;  // at x = 0.3
  EXPECT_NEAR(end.at("h")[cell], 1.453840892, 5e-4);
  EXPECT_NEAR(end.at("m")[cell] / end.at("h")[cell], 0.416920631, 5e-4);
}

/// f*v = g*deta/dx holds in the limit: the imbalance is of order 2.
TEST(Staggered, GeostrophicBalanceHolds) {
  EXPECT_NEAR(order(shallow_water, "jet", "eta", 16), 2, 0.1);
  EXPECT_NEAR(order(shallow_water, "jet", "u.y", 16), 2, 0.1);
}

}  // namespace
}  // namespace dpde
