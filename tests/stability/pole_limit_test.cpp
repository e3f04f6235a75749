// SPDX-License-Identifier: Apache-2.0
// Shallow water on a sphere: limits predicted on the scene's own grid, compared with runs of the step itself.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/equations.h"
#include "stability/frozen/frozen_points.h"
#include "stability/stability_support.h"
#include "stability/step/coupled_means.h"
#include "stability/trial.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// A jet at the equator, in balance; `gain` and `push` are what moves depth and wind.
std::string jet(const std::string& solves, const std::string& push, const std::string& gain, const std::string& poles) {
  return fmt::format(
      "operator short_waves(p) order 4 = p[+2, 0] - 4*p[+1, 0] + 6*p - 4*p[-1, 0] + p[-2, 0]"
      " + hx^2*(p[+1, 0] - 2*p + p[-1, 0])\n"
      "model water {{ vector u on faces; field h; let flux = interpolate(h)*u; let r = 1/(8*cos(lat)); {}"
      " dt(u) = -cross((curl(u) + 1.4e-4*sin(lat))/interpolate(h), flux) - grad({}); dt(h) = {} }}\n"
      "scheme plain {{ dx = central(2); lap = central(2); time = rk4 }}\n"
      "scene s : water with plain {{ coordinates sphere(6.4e6)\n"
      "grid lon = 0 .. 2*pi, cells 32, periodic; grid lat = -pi/2 .. pi/2, cells 16\n"
      "boundary u.x: lat = pole; boundary u.y: lat = 0; boundary h: lat = pole; {}"
      " initial u = (20*cos(lat), 0); initial h = 5000 - 935*sin(lat)^2; time 0 .. 432000, step 100 }}\n",
      solves, push, gain, poles);
}

/// The largest stable step by runs of the tangent, within a hundredth.
double predicted_limit(driver::Session& session) {
  std::string why;
  const auto linear = linear_step(session, why);
  const auto runs =
      CoupledRuns::make(session, *linear, frozen_points(session, *linear).front().point, false, session.problem().step);
  if (runs == nullptr) return 0;
  double low = 300, high = 5000;
  while (high - low > 1e-2 * low) {
    const double middle = std::sqrt(low * high);
    (runs->is_stable(middle) ? low : high) = middle;
  }
  return low;
}

void expect_limit_of_runs(const std::string& text) {
  const auto session = open_scene(text);
  const double limit = predicted_limit(*session);
  const auto below = try_step(*session, 0.97 * limit, {.steps = 200}),
             above = try_step(*session, 1.06 * limit, {.steps = 200});
  EXPECT_TRUE(below->is_stable) << limit << " " << below->growth;
  EXPECT_FALSE(above->is_stable) << limit << " " << above->growth;
}

constexpr const char *push = "9.8*h + 0.5*dot(u, u)", *gain = "-div(flux)";

/// Waves that a filter slows down grow only in the row next to the pole, which frozen waves do not represent.
TEST(Poles, TheLimitWithAFilterIsThatOfRuns) {
  const std::string solves =
      fmt::format("solve push + r^4*short_waves(push) = {} for push; solve gain + r^4*short_waves(gain) = {} for gain;",
                  push, gain);
  expect_limit_of_runs(jet(solves, "push", "gain", "boundary push: lat = pole; boundary gain: lat = pole;"));
}

TEST(Poles, TheLimitIsThatOfRuns) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  expect_limit_of_runs(jet("", push, gain, ""));
}

}  // namespace
}  // namespace dpde::stability
