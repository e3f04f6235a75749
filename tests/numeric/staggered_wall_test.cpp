// SPDX-License-Identifier: Apache-2.0
// Conditions other than values at walls on which points of a field lie: orders against exact solutions, on uniform and
// stretched axes, outgoing waves and water, bit-identical back ends, certified derivatives.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

double order(const std::string& text, const std::string& scene, const std::string& field, int cells,
             const Overrides& more = {}) {
  Overrides coarse = more, fine = more;
  coarse["cells"] = std::to_string(cells);
  fine["cells"] = std::to_string(2 * cells);
  return std::log2(run_scene(text, scene, coarse).l2.at(field) / run_scene(text, scene, fine).l2.at(field));
}

std::string rod(const std::string& stretch, const std::string& boundary) {
  return "model heat { field u on faces.x; param kappa; dt(u) = kappa*lap(u) }\nscheme s { lap = central(2); time = "
         "rk4 }\nscene s : heat with s {\n"
         "  grid x = 0 .. 1, cells 8" +
         stretch + "\n  kappa = 0.5\n  boundary u: " + boundary +
         "\n  initial u = sin(x + 0.2)\n  exact u = exp(-kappa*t)*sin(x + 0.2)\n  time 0 .. 0.25, step 1/8192\n}\n";
}

TEST(StaggeredWall, ConditionsThatVaryInTimeAreOfOrderTwo) {
  const std::string low_value = "x.low = exp(-kappa*t)*sin(0.2)", high_value = "x.high = exp(-kappa*t)*sin(x + 0.2)";
  const std::string low_slope = "x.low = gradient(-exp(-kappa*t)*cos(0.2))",
                    high_slope = "x.high = gradient(exp(-kappa*t)*cos(1.2))";
  const std::string low_mixed = "x.low = mixed(1, 0.5, exp(-kappa*t)*(sin(0.2) - 0.5*cos(0.2)))";
  const std::string high_mixed = "x.high = mixed(2, 3 + t, exp(-kappa*t)*(2*sin(1.2) + (3 + t)*cos(1.2)))";
  const std::string both[] = {low_value + ", " + high_slope, low_slope + ", " + high_mixed,
                              low_mixed + ", " + high_value, low_mixed + ", " + high_mixed,
                              low_slope + ", " + high_slope};
  for (const char* stretch : {"", ", stretched (exp(1.5*x) - 1)/(exp(1.5) - 1)"}) {
    for (const std::string& boundary : both)
      EXPECT_NEAR(order(rod(stretch, boundary), "s", "u", 16), 2, 0.2) << stretch << " " << boundary;
  }
}

/// The final value on the high wall fits the values next to it: 3w - 4u + v = 2h*g.
TEST(StaggeredWall, StatesHoldTheValueOnTheWall) {
  for (const char* time : {"euler", "rk4", "ab2"}) {
    const auto u =
        run_scene(rod("", "x.low = zero_gradient, x.high = gradient(0.3 + t)"), "s", {{"time", time}}).state.at("u");
    EXPECT_NEAR(3 * u[7] - 4 * u[6] + u[5], 2.0 / 8 * (0.3 + 0.25), 1e-14) << time;
  }
}

/// The suggestion of an error message about an unused level: eta is L(t) on the wall if the slope of u is L'(t)/c,
/// outward.
TEST(StaggeredWall, ATideIsASlopeOfTheVelocity) {
  const std::string text = R"(
model tide { field u on faces.x; field eta; param c; dt(eta) = -c*dx(u); dt(u) = -dx(eta)/c }
scene low : tide {
  grid x = 0 .. 1, cells 16
  c = 2
  boundary eta: x = zero_gradient
  boundary u: x.low = gradient(1.5*cos(3*t)/c), x.high = 0
  initial eta = 0
  initial u = 0.5*sin(3*(1 - x))/cos(3)/c
  exact eta = 0.5*cos(3*(1 - x))/cos(3)*sin(3*t)
  time 0 .. 2, step 1/1024
}
scene high : tide {
  grid x = 0 .. 1, cells 16
  c = 2
  boundary eta: x = zero_gradient
  boundary u: x.low = 0, x.high = gradient(-1.5*cos(3*t)/c)
  initial eta = 0
  initial u = -0.5*sin(3*x)/cos(3)/c
  exact eta = 0.5*cos(3*x)/cos(3)*sin(3*t)
  time 0 .. 2, step 1/1024
}
)";
  for (const char* scene : {"low", "high"}) EXPECT_NEAR(order(text, scene, "eta", 16), 2, 0.1) << scene;
}

/// A wave between two open ends, where the surface is fixed and the velocity has zero slope, and one on a membrane
/// whose nodes lie on its free rim.
const std::string staggered_waves = R"(
model gravity_wave {
  vector u on faces
  field eta
  dt(eta) = -div(u)
  dt(u) = -grad(eta)
}
model membrane { field w on nodes; dt(dt(w)) = lap(w) }
scheme s { dx = central(2); lap = central(2); time = rk4 }
scene open : gravity_wave with s {
  grid x = 0 .. 1, cells 16
  boundary u = zero_gradient
  boundary eta = 0
  initial u = 0
  initial eta = sin(pi*x)
  exact u = -cos(pi*x)*sin(pi*t)
  exact eta = sin(pi*x)*cos(pi*t)
  time 0 .. 1.25, step 1.25/2048
}
scene rim : membrane with s {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 1, cells 8
  boundary w: x = zero_gradient, y.low = zero_gradient, y.high = 0
  initial w = cos(2*pi*x)*cos(pi*y/2)
  initial dt(w) = 0
  exact w = cos(2*pi*x)*cos(pi*y/2)*cos(sqrt(17/4)*pi*t)
  time 0 .. 0.75, step 1/1024
}
)";

TEST(StaggeredWall, WavesBetweenOpenEndsAreOfOrderTwo) {
  for (const char* field : {"u.x", "eta"})
    EXPECT_NEAR(order(staggered_waves, "open", field, 256), 2, 0.15) << field;  // coarser grids show their third order
  EXPECT_NEAR(order(staggered_waves, "rim", "w", 64), 2, 0.2);
  EXPECT_NEAR(order(staggered_waves, "rim", "w", 64, {{"time", "verlet"}}), 2, 0.2);
  for (const auto& [field, error] : run_scene(staggered_waves, "open", {{"end", "20"}, {"step", "1/64"}}).l2)
    EXPECT_LT(error, 0.2) << field;  // no growth
}

/// Outflow with a current faster than the waves: no reflection.
TEST(StaggeredWall, WaterLeaves) {
  const std::string text = R"(
model shallow_water {
  vector u on faces
  field h
  dt(h) = -div(interpolate(h)*u)
  dt(u) = -advect(u, u) - grad(h)
}
scheme s { dx = central(2); advect = upwind(3); time = ssp_rk3 }
scene outflow : shallow_water with s {
  grid x = 0 .. 4, cells 200
  boundary u: x.low = 2, x.high = zero_gradient
  boundary h: x.low = 1, x.high = zero_gradient
  initial u = 2 + 0.1*exp(-20*(x - 2)^2)
  initial h = 1 + 0.1*exp(-20*(x - 2)^2)
  time 0 .. 4, step 1/200
}
)";
  const auto end = run_scene(text, "outflow").state;
  const auto early = run_scene(text, "outflow", {{"end", "0.5"}}).state;
  const auto furthest = [](const std::vector<double>& values, double from) {
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value - from));
    return largest;
  };
  EXPECT_GT(furthest(early.at("h"), 1), 0.05);
  EXPECT_LT(furthest(end.at("h"), 1), 2e-3);
  EXPECT_LT(furthest(end.at("u.x"), 2), 2e-3);
}

const std::string plate_on_faces = R"(
model m {
  vector u on faces
  field p
  coefficient g
  param a, b, A
  dt(u) = 0.1*lap(u) - interpolate(p)*dx(u) - grad(p)
  dt(p) = -div(u) + g*p^2
}
)";

std::string plate_scene(const std::string& x, const std::string& y, const std::string& scheme) {
  return plate_on_faces + "scheme c { " + scheme + " }\nscene s : m with c {\n  grid x = 0 .. 1, cells " + x +
         "\n  grid y = 0 .. 1, cells " + y +
         "\n  a = 0.6\n  b = 0.3\n  A = 0.5\n  g = 1 + y\n"
         "  boundary u.x: x.low = gradient(g*A*cos(t)), x.high = mixed(a, b*(1 + t), A)" +
         (y.ends_with("periodic") ? "" : ", y = zero_gradient") + "\n  boundary u.y: x = zero_gradient" +
         (y.ends_with("periodic") ? "" : ", y.low = mixed(1 + a^2, sin(b), A*x), y.high = zero_gradient") +
         "\n  boundary p: x = zero_gradient" + (y.ends_with("periodic") ? "" : ", y = zero_gradient") +
         "\n  initial u = (x, 0.3*y)\n  initial p = 1 + x\n  time 0 .. 1/32, step 1/256\n}\n"
         "task t : s {\n  unknown a\n  unknown b\n  unknown A\n  unknown g\n  unknown initial u\n  minimise "
         "mean(u.x^3) + mean(u.y^2) + mean(dx(u.x)^2)\n}\n";
}

TEST(StaggeredWall, DerivativesAreCertified) {
  for (const std::string x : {"1", "2", "3", "5"}) {  // each certificate also covers many small grids
    const std::string y = x == "1" ? "3, periodic" : x == "2" ? "1" : x == "3" ? "2" : "4";
    SCOPED_TRACE(x + " x " + y);
    expect_certified(plate_scene(x, y, "time = rk2"), x == "2" || x == "3");
  }
  expect_certified(plate_scene("4", "3", "time = ab2; dx = central(4); lap = central(4)"), true);
  expect_certified(plate_scene("5, stretched (exp(x) - 1)/(exp(1) - 1)", "3, stretched tanh(y)/tanh(1)", "time = rk4"),
                   true);
}

TEST(StaggeredWall, BackEndsAgree) {
  for (const std::string x : {"1", "2", "3", "6"}) {
    for (const std::string y : {"1", "5"}) {
      const std::string text = plate_scene(x, y, "time = rk2");
      const auto wanted = run_scene(text, "s", {}, driver::Backend::interpreter).state;
      for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
        if (backend == driver::Backend::cpp && (x != "3" || y == "1")) continue;
        const auto got = run_scene(text, "s", {}, backend).state;
        for (const auto& [field, values] : wanted) {
          for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_NEAR(got.at(field)[i], values[i], 1e-14) << x << " x " << y << " " << field << " " << i;
        }
      }
    }
  }
}

/// Estimates the slope of the water at an open end from the later state.
TEST(StaggeredWall, AnUnknownSlopeHasTheGradientOfDifferences) {
  const auto text = [](double g) {
    return "model m { field u on faces.x; param g; dt(u) = lap(u) }\nscheme c { time = rk4 }\nscene s : m with c {\n  "
           "grid x = 0 .. 1, cells 6\n"
           "  g = " +
           std::to_string(g) +
           "\n  boundary u: x.low = gradient(g), x.high = mixed(1, 1, g)\n  initial u = x\n  time 0 .. 1/8, step "
           "1/1024\n}\n"
           "task t : s {\n  unknown g\n  minimise mean((u - 0.5)^2)\n}\n";
  };
  const double got = task_gradient(text(0.3), "t").gradient.at("g")[0];
  EXPECT_NEAR(got, (task_loss(text(1.3), "t") - task_loss(text(-0.7), "t")) / 2,
              1e-12);  // the loss is quadratic in g
}

}  // namespace
}  // namespace dpde::testing
