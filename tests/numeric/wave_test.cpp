// SPDX-License-Identifier: Apache-2.0
// Equations with a second time derivative: closed forms of the wave equation (numerics.md, section 3), conserved
// energy, limits of stability, damping, and gradients with respect to the velocity at the start.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;
using testing::task_gradient;

const std::string waves = R"(
model wave { field u; param c; dt(dt(u)) = c^2*lap(u) }
model damped { field u, w; param c, g; dt(dt(u)) = c^2*lap(u) - 2*g*dt(u); dt(w) = -g*w + dt(u) }
model rubbed { field u, w; param c, g; dt(dt(u)) = c^2*lap(u) - dt(u)*2*g; dt(w) = u }
scheme s { lap = central(2); time = verlet }
scene thread : rubbed with s {
  grid x = 0 .. 2*pi, cells 1, periodic
  c = 1
  g = 0.7
  initial u = 1
  initial dt(u) = 1
  initial w = 0
  exact   u = 1 + (1 - exp(-2*g*t))/(2*g)
  exact   w = t + (t - (1 - exp(-2*g*t))/(2*g))/(2*g)
  time 0 .. 1, step 1/16
}
scene string : wave with s {
  grid x = 0 .. 2*pi, cells 32, periodic
  c = 2
  initial u = sin(x) + 0.3*cos(2*x)
  initial dt(u) = 0.5*sin(3*x)
  exact   u = cos(2*t)*sin(x) + 0.3*cos(4*t)*cos(2*x) + sin(6*t)/12*sin(3*x)
  exact   dt(u) = -2*sin(2*t)*sin(x) - 1.2*sin(4*t)*cos(2*x) + 0.5*cos(6*t)*sin(3*x)
  time 0 .. 1, step 1/64
}
scene square : wave with s {
  grid x = 0 .. 1, cells 16
  grid y = 0 .. 1, cells 16
  boundary u: x = 0, y = zero_gradient
  c = 1
  initial u = sin(2*pi*x)*cos(pi*y)
  initial dt(u) = 0
  exact   u = cos(pi*sqrt(5)*t)*sin(2*pi*x)*cos(pi*y)
  time 0 .. 0.5, step 1/64
}
scene ring : damped with s {
  grid x = 0 .. 2*pi, cells 1, periodic
  c = 1
  g = 0.7
  initial u = 1
  initial dt(u) = 1
  initial w = 0
  exact   u = 1 + (1 - exp(-2*g*t))/(2*g)
  exact   w = (exp(-g*t) - exp(-2*g*t))/g
  time 0 .. 1, step 1/16
}
task push : string {
  unknown initial dt(u)
  minimise integral(u^2) at t = 1
}
)";

double order_of(const std::string& scene, const std::vector<Overrides>& levels, const std::string& field) {
  const double before = run_scene(waves, scene, levels[levels.size() - 2]).l2.at(field);
  const double last = run_scene(waves, scene, levels.back()).l2.at(field);
  EXPECT_GT(last, 1e-13);
  return std::log2(before / last);
}

std::vector<Overrides> refined(Overrides common, const std::vector<std::pair<int, int>>& cells_and_steps) {
  std::vector<Overrides> levels;
  for (const auto& [cells, steps] : cells_and_steps) {
    common["cells"] = std::to_string(cells);
    common["step"] = "1/" + std::to_string(steps);
    levels.push_back(common);
  }
  return levels;
}

TEST(Wave, VelocityVerletIsOfOrderTwo) {
  const auto levels = refined({{"time", "verlet"}}, {{64, 64}, {128, 128}});
  EXPECT_NEAR(order_of("string", levels, "u"), 2, 0.15);
  EXPECT_NEAR(order_of("string", levels, "u_t"), 2, 0.15);
  EXPECT_NEAR(order_of("square", refined({{"time", "verlet"}}, {{16, 64}, {32, 128}}), "u"), 2, 0.15);
}

TEST(Wave, LeapfrogIsOfOrderTwo) {
  const auto levels = refined({{"time", "leapfrog"}}, {{64, 64}, {128, 128}});
  EXPECT_NEAR(order_of("string", levels, "u"), 2, 0.15);
  EXPECT_NEAR(order_of("square", refined({{"time", "leapfrog"}}, {{16, 64}, {32, 128}}), "u"), 2, 0.15);
  const std::vector<Overrides> damped{{{"time", "leapfrog"}, {"step", "1/64"}},
                                      {{"time", "leapfrog"}, {"step", "1/128"}}};
  EXPECT_NEAR(order_of("thread", damped, "u"), 2, 0.15);
  EXPECT_NEAR(order_of("thread", damped, "w"), 2, 0.15);
}

/// Stoermer-Verlet and velocity Verlet are two forms of one method: equal positions up to rounding.
TEST(Wave, LeapfrogMovesAsVerletDoes) {
  const auto leapfrog = run_scene(waves, "square", {{"time", "leapfrog"}}).state.at("u");
  const auto verlet = run_scene(waves, "square", {{"time", "verlet"}}).state.at("u");
  ASSERT_EQ(leapfrog.size(), verlet.size());
  for (size_t i = 0; i < verlet.size(); ++i) EXPECT_NEAR(leapfrog[i], verlet[i], 1e-12);
}

TEST(Wave, OtherSchemesKeepTheirOrderOnTheSystemOfFirstOrder) {
  EXPECT_NEAR(order_of("string", refined({{"time", "rk4"}, {"lap", "central4"}}, {{48, 96}, {96, 192}}), "u"), 4, 0.15);
  EXPECT_NEAR(order_of("string", refined({{"time", "ssp_rk3"}, {"lap", "central8"}}, {{64, 128}, {64, 256}}), "u"), 3,
              0.15);
}

/// Forces that contain the velocity, and a field of first order that follows it.
TEST(Wave, DampingAndMixedOrdersKeepOrderTwo) {
  const std::vector<Overrides> levels{{{"step", "1/64"}}, {{"step", "1/128"}}};
  EXPECT_NEAR(order_of("ring", levels, "u"), 2, 0.15);
  EXPECT_NEAR(order_of("ring", levels, "w"), 2, 0.15);
}

/// With dt(u) = 0 at the start the first step is the mean of the neighbours, and Verlet moves the two halves by a cell
/// per step: exact at Courant number 1.
TEST(Wave, BothFormsAreExactAtCourantNumberOneAndBreakAboveIt) {
  const Overrides exact{{"cells", "40"}, {"step", "2*pi/40/2"}, {"end", "2*pi/2"}};
  Overrides leapfrog = exact;
  leapfrog["time"] = "leapfrog";
  std::string text = waves;
  text.replace(text.find("0.5*sin(3*x)\n"), 12, "0           ");
  text.replace(text.find(" + sin(6*t)/12*sin(3*x)"), 23, "");
  EXPECT_LT(run_scene(text, "string", exact).l2.at("u"), 1e-12);
  EXPECT_LT(run_scene(text, "string", leapfrog).l2.at("u"), 1e-12);
  // a little above the limit the highest mode, seeded by rounding, grows by exp(acosh) a step
  const auto largest = [&](const std::string& step) {
    const auto result = run_scene(text, "string", {{"cells", "40"}, {"step", step}, {"end", "1500*" + step}});
    double value = 0;
    for (const double v : result.state.at("u")) value = std::max(value, std::abs(v));
    return value;
  };
  EXPECT_LT(largest("0.99*2*pi/80"), 2);
  EXPECT_GT(largest("1.01*2*pi/80"), 1e3);
}

/// On a linear wave Verlet conserves 1/2 v.v + 1/2 (c D u).(c D u) - (dt/2)^2/2 a.a to rounding: a quadratic form of
/// the state.
TEST(Wave, VerletKeepsItsShiftedEnergy) {
  const int cells = 24;
  const double h = 2 * std::acos(-1.0) / cells, dt = 1.0 / 50, c = 2;
  const auto energy = [&](const std::string& end) {
    const auto state = run_scene(waves, "string", {{"cells", "24"}, {"step", "1/50"}, {"end", end}}).state;
    const std::vector<double>&u = state.at("u"), &v = state.at("u_t");
    double sum = 0;
    for (int i = 0; i < cells; ++i) {
      const double right = u[(i + 1) % cells], left = u[(i + cells - 1) % cells];
      const double slope = c * (right - u[i]) / h, force = c * c * (right - 2 * u[i] + left) / (h * h);
      sum += v[i] * v[i] + slope * slope - dt * dt / 4 * force * force;
    }
    return sum;
  };
  const double start = energy("1/50");
  EXPECT_NEAR(energy("1/2") / start, 1, 1e-13);
  EXPECT_NEAR(energy("10") / start, 1, 1e-12);
}

/// J = int u(T)^2 is quadratic in the mode 0.5*sin(3x) of the velocity: its gradient is 2 u(T) propagated back.
TEST(Wave, GradientWithRespectToTheVelocityAtTheStart) {
  for (const char* time : {"verlet", "leapfrog", "rk4"}) {
    const Overrides fine{{"cells", "128"}, {"step", "1/256"}, {"time", time}};
    const auto result = task_gradient(waves, "push", fine);
    const std::vector<double>& gradient = result.gradient.at("u_t");
    const double h = 2 * std::acos(-1.0) / 128;
    for (int i = 0; i < 128; i += 9) {
      const double x = (i + 0.5) * h;
      const double exact =
          2 * h *
          (std::cos(2.0) * std::sin(2.0) / 2 * std::sin(x) + 0.3 * std::cos(4.0) * std::sin(4.0) / 4 * std::cos(2 * x) +
           std::sin(6.0) / 12 * std::sin(6.0) / 6 * std::sin(3 * x));
      EXPECT_NEAR(gradient[i], exact, 2e-3 * h) << time;
    }
  }
}

}  // namespace
}  // namespace dpde
