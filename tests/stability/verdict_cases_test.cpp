// SPDX-License-Identifier: Apache-2.0
// Verdicts with small growth, small grids, or other growing states: each was once wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/report/ill_posed.h"
#include "stability/stability_report.h"
#include "stability/trial.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

using std::numbers::pi;

/// 40 cells of 1/40 along each axis.
std::string waves_on_faces(const std::string& time) {
  return "model m { field p; vector u on faces; dt(p) = -div(u); dt(u) = -grad(p) }\nscheme c { time = " + time +
         " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 40, periodic\n  grid y = 0 .. 1, cells 40, periodic\n"
         "  initial p = cos(2*pi*x)\n  initial u = 0\n  time 0 .. 1, step 1e-3\n}\n";
}
std::string oscillator(const std::string& time, double step) {
  return "model m { field a, b; dt(a) = 10*b; dt(b) = -10*a }\nscheme c { time = " + time +
         " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 4, periodic\n  initial a = 1\n  initial b = 0\n" +
         fmt::format("  time 0 .. {}, step {}\n}}\n", 100 * step, step);
}

/// |g| - 1 is (w dt)^4/4 by ab2 and (w dt)^4/8 by rk2 (D. R. Durran, Numerical Methods for Fluid Dynamics, table 2.2):
/// steps that are short enough hide it behind rounding, and are no more stable.
TEST(VerdictCases, WeakGrowthIsNoLimit) {
  for (const auto& [time, part] : {std::pair{"ab2", 0.25}, {"rk2", 0.125}}) {
    for (const double step : {0.01, 0.002}) {
      const auto session = open_scene(oscillator(time, step));
      const StabilityReport verdict = verdict_of(*session);
      ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::never) << time;
      EXPECT_NEAR(verdict.limit.order, 4, 0.1) << time;
      EXPECT_NEAR(verdict.growth - 1, part * std::pow(10 * step, 4), 0.1 * part * std::pow(10 * step, 4)) << time;
      EXPECT_EQ(verdict.growth_rate, 0) << "the equations let nothing grow";
    }
    EXPECT_EQ(verdict_of(*open_scene(waves_on_faces(time))).limit.kind, StepLimit::Kind::never) << time;
  }
}

/// A shear flow between walls lets waves grow by half its slope, 4, at most (Orr and Sommerfeld), on any grid. With the
/// slope of the metric in the constraint's operator, and none in what it takes off, short waves seemed to be ill-posed.
TEST(VerdictCases, StretchedChannelsAreWellPosed) {
  for (const char* stretched : {"", ", stretched 0.5 + 0.5*tanh(2*(2*y - 1))/tanh(2)"}) {
    const auto session = open_scene(
        std::string("model m { vector u on faces; field p; param nu\n  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)\n"
                    "  0 = div(u) gives p }\nscene s : m {\n  grid x = 0 .. 4, cells 8, periodic\n"
                    "  grid y = 0 .. 1, cells 8") +
        stretched +
        "\n  nu = 0.001\n  boundary u: y = 0\n  initial u = (4*y*(1 - y), 0)\n  time 0 .. 0.1, step 0.01\n}\n");
    EXPECT_FALSE(ill_posed(*session)) << stretched;
    if (*stretched != 0) EXPECT_LT(verdict_of(*session).growth_rate, 2);
  }
}

/// The mean grows as the equations let it, by exp(40 t) less what diffuses; short waves are damped. The limit of ab2
/// is that of the shortest wave, dt*|rate| = 1, and twice that of the mean's growth is allowed.
TEST(VerdictCases, SchemesWithAMemoryBearMeansThatGrow) {
  for (const int cells : {12, 16, 24, 25, 64}) {
    const auto session =
        open_scene("model m { field u; dt(u) = lap(u) + 0.2*u }\nscheme c { time = ab2 }\nscene s : m with c {\n" +
                   fmt::format("  grid x = 0 .. {0}, cells {0}, periodic\n  initial u = 1 + sin(2*pi*x/{0})\n", cells) +
                   "  time 0 .. 1, step 0.01\n}\n");
    const StabilityReport verdict = verdict_of(*session);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << cells;
    const double shortest = 4 * std::pow(std::sin(pi * (cells / 2) / cells), 2) - 0.2;
    EXPECT_NEAR(verdict.limit.step, 1 / shortest, 5e-3 / shortest) << cells;
    EXPECT_NEAR(verdict.growth_rate, 0.2, 0.01) << cells;
  }
}

/// A rotation of the mean grows by (f dt)^2/2 a step with Euler's method, whatever diffuses away from it; so does what
/// an implicit scheme leaves explicit.
TEST(VerdictCases, TheMeanIsAWaveToo) {
  const auto scene = [](const std::string& scheme, const std::string& rates, int cells) {
    return open_scene("model m { field a, b; " + rates + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n" +
                      fmt::format("  grid x = 0 .. 1, cells {}, periodic\n", cells) +
                      "  initial a = 1\n  initial b = 0\n  time 0 .. 1, step 1/800\n}\n");
  };
  for (const int cells : {16, 40}) {
    const auto session = scene("time = euler", "dt(a) = lap(a) + 10*b; dt(b) = lap(b) - 10*a", cells);
    EXPECT_TRUE(verdict_of(*session).is_above()) << cells;
    const auto imex = scene("time = imex_euler", "dt(a) = 10*lap(a) - 100*a; dt(b) = 10*lap(b) - 100*b", cells);
    const StabilityReport verdict = verdict_of(*imex);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << cells;
    EXPECT_NEAR(verdict.limit.step, 0.02, 1e-4) << cells;
  }
}

/// The shortest wave of n cells has the angle pi - pi/n where n is odd: the limit is h^2/(2 k cos(pi/(2n))^2).
TEST(VerdictCases, SmallRingsHaveTheirOwnWaves) {
  for (const int cells : {2, 3, 5, 8, 9, 23}) {
    const auto session =
        open_scene("model m { field u; dt(u) = lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n" +
                   fmt::format("  grid x = 0 .. {0}, cells {0}, periodic\n  initial u = sin(2*pi*x/{0})\n", cells) +
                   "  time 0 .. 1, step 0.1\n}\n");
    const double shortest = cells % 2 == 0 ? 1 : std::cos(pi / (2 * cells)), expected = 0.5 / (shortest * shortest);
    const StabilityReport verdict = verdict_of(*session);
    EXPECT_TRUE(verdict.is_exact);
    EXPECT_NEAR(verdict.limit.step, expected, 1e-4 * expected) << cells;
    const Search found = search_limit(*session, verdict.limit.step, 2e-3, 2, {});
    EXPECT_NEAR(found.largest, expected, 3e-3 * expected) << cells;
  }
}

/// The wave of two cells has no slope at their centres; that of 2.29 is the shortest of 16 that has one.
TEST(VerdictCases, SpectralSlopesOfSmallRings) {
  const auto session = open_scene(
      "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = spectral; time = rk4 }\nscene s : m with c {\n"
      "  grid x = 0 .. 16, cells 16, periodic\n  initial u = sin(2*pi*x/16)\n  time 0 .. 1, step 0.1\n}\n");
  const double expected = 2 * std::sqrt(2.0) / (2 * pi * 7 / 16);
  EXPECT_NEAR(verdict_of(*session).limit.step, expected, 2e-3 * expected);
  EXPECT_NEAR(search_limit(*session, expected, 2e-3, 2, {}).largest, expected, 0.02 * expected);
}

/// Excitable kinetics grow by e in 1.5; that Euler's method lets a slower wave grow by 1e-6 a step is no fault.
TEST(VerdictCases, WhatGrowsSlowerThanTheSolutionIsNoFault) {
  const auto session = open_scene(
      "model m { field u, v; dt(u) = lap(u) + u - u^3 - v; dt(v) = 0.1*(u - v) }\nscheme c { time = euler }\n"
      "scene s : m with c {\n  grid x = 0 .. 10, cells 50, periodic\n  initial u = cos(2*pi*x/10)\n  initial v = 0\n"
      "  time 0 .. 10, step 0.01\n}\n");
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 0.02, 0.02 * 0.02) << "h^2/2, and a little less for what reacts";
  EXPECT_GT(verdict.growth_rate, 0.5);
}

/// Rounding of single precision is as large as a small disturbance: it does not count as growth.
TEST(VerdictCases, RunsInSinglePrecision) {
  for (const int cells : {64, 256}) {
    const auto session = open_scene(
        "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = central(4); time = rk4; real = f32 }\n" +
        fmt::format("scene s : m with c {{\n  grid x = 0 .. 1, cells {}, periodic\n", cells) +
        "  initial u = sin(2*pi*x)\n  time 0 .. 1, step 1e-3\n}\n");
    const double expected = verdict_of(*session).limit.step;
    EXPECT_NEAR(search_limit(*session, expected, 4e-3, 2, {.steps = 20000}).largest, expected, 0.02 * expected);
  }
}

/// A small field whose equation reads a large one has no digits below the rounding of that, and Newton's method says
/// so.
TEST(VerdictCases, NoStepIsTooLargeBesideALargeField) {
  const auto session = open_scene(
      "model m { field u, v; dt(u) = 0.482*lap(u) - advect(0.35, u) - 0.01*lap(lap(u)) - 0.2*dx(v); "
      "dt(v) = 0.31*lap(v) }\n"
      "scheme c { advect = upwind(1); implicit = all_but_advect; time = imex_euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1.33, cells 5, stretched 1.33*(exp(1.2*x/1.33) - 1)/(exp(1.2) - 1)\n"
      "  boundary u: x.low = 0, x.high = zero_gradient\n  boundary v: x.low = linear, x.high = zero_gradient\n"
      "  initial u = sin(x)\n  initial v = 1 + sin(x)\n  time 0 .. 1, step 1e-2\n}\n");
  EXPECT_EQ(verdict_of(*session).limit.kind, StepLimit::Kind::none);
  for (const double step : {0.1, 1.0, 10.0}) EXPECT_TRUE(try_step(*session, step, {.steps = 1500})->is_stable) << step;
}

/// What a scheme remembers of steps that were not made is not disturbed: rates are 1e9 times as large here.
TEST(VerdictCases, RunsOfSchemesWithAMemory) {
  for (const char* time : {"ab2", "ab3"}) {
    const auto session =
        open_scene(std::string("model m { field u; dt(u) = -lap(lap(u)) }\nscheme c { time = ") + time +
                   " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 40, periodic\n  initial u = cos(2*pi*x)\n"
                   "  time 0 .. 1e-6, step 1e-9\n}\n");
    const double expected = verdict_of(*session).limit.step, limit = time == std::string("ab2") ? 1 : 6.0 / 11;
    EXPECT_NEAR(expected, limit / (16 * std::pow(40.0, 4)), 1e-3 * expected);
    EXPECT_NEAR(search_limit(*session, expected, 4e-3, 2, {.steps = 4000}).largest, expected, 0.02 * expected) << time;
  }
}

}  // namespace
}  // namespace dpde::stability
