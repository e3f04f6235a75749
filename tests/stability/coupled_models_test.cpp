// SPDX-License-Identifier: Apache-2.0
// Coupled models with substeps, means and walls: the limit compared with runs of the step itself.
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/trial.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// Shallow water in a channel, which swells where T is above its mean; T is carried by it, and warmed unevenly.
const std::string air_and_ground = R"(
model air { vector u on faces; field h; coefficient T; param g
  dt(u.x) = 1e-4*interpolate(u.y) - g*dx(h) + 1e5*lap(u.x)
  dt(u.y) = -1e-4*interpolate(u.x) - g*dy(h) + 1e5*lap(u.y)
  dt(h) = -div(interpolate(h)*u) + 1e-6*(2*(T - mean(T)) - (h - mean(h))) }
model ground { field T; coefficient vector u on faces; coefficient sun
  dt(T) = (sun - T)*1e-6 - div(interpolate(T)*u) + 1e5*lap(T) }
scheme c { dx = central(2); lap = central(2); time = rk4 }
scene s : air, ground with c {
  grid x = 0 .. 1e7, cells 16, periodic; grid y = 0 .. 5e6, cells 8
  g = 9.81; sun = 22 - 1e-6*y + sin(2*pi*x/1e7)
  boundary u.x: y = zero_gradient; boundary u.y: y = 0; boundary h: y = zero_gradient; boundary T: y = zero_gradient
  initial u = (5*cos(pi*y/5e6), 0); initial h = 1000 + 1e-5*y; initial T = 20
  subcycle u, h in 4
  time 0 .. 2592000, step 7200 }
)";

TEST(CoupledModels, HaveTheLimitOfRuns) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const auto session = open_scene(air_and_ground);
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  const double limit = verdict.limit.step;
  // Waves of two cells along x and y: 2 sqrt(g h (1/hx^2 + 1/hy^2)) dt/4 = sqrt(8), hx = hy.
  EXPECT_NEAR(limit, 4 * std::sqrt(8.0) / (2 * std::sqrt(2 * 9.81 * 1000) / 6.25e5), 0.1 * limit);
  EXPECT_TRUE(try_step(*session, 0.95 * limit, {.steps = 1000})->is_stable) << limit;
  EXPECT_FALSE(try_step(*session, 1.06 * limit, {.steps = 1000})->is_stable) << limit;
}

}  // namespace
}  // namespace dpde::stability
