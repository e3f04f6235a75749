// SPDX-License-Identifier: Apache-2.0
// Steps that have an effect at any length, means that persist, and times between the sampled ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/trial.h"

namespace dpde::stability {
namespace {

StabilityReport verdict_on_ring(const std::string& equations, const std::string& scheme, const std::string& rest) {
  return verdict_of(*open_scene("model m { " + equations + " }\nscheme c { " + scheme +
                                " }\nscene s : m with c {\n  grid x = 0 .. 1, cells " + rest + "\n}\n"));
}

/// The wave of two cells: 0.99 (1 - 4 dt/h^2) = -1.
TEST(AtRest, WhatDampsWhateverTheStepHasLimits) {
  const StabilityReport damped = verdict_on_ring("field u; dt(u) = lap(u)", "time = euler",
                                                 "40, periodic\n  initial u = sin(2*pi*x)\n  after step: u = 0.99*u\n"
                                                 "  time 0 .. 1, step 1/1000");
  EXPECT_NEAR(damped.limit.step, (1 + 1 / 0.99) / 6400, 1e-3 / 6400);
  EXPECT_TRUE(damped.ruins_run());
}

/// Beside diffusion the clamp of MacCormack's scheme cuts nothing off slopes: 4 nu dt/h^2 = 2 - v dt/h.
TEST(AtRest, MacCormackBesideDiffusionIsLimitedByIt) {
  for (const int cells : {32, 64}) {
    const double h = 1.0 / cells, v = 1, nu = 0.5;
    const StabilityReport verdict =
        verdict_on_ring("field u; dt(u) = -advect(1, u) + 0.5*lap(u)", "advect = maccormack; time = euler",
                        fmt::format("{}, periodic\n  initial u = sin(2*pi*x)\n  time 0 .. 1, step 1/1000", cells));
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(verdict.limit.step, 2 / (4 * nu / (h * h) + v / h), 0.02 * h * h) << cells;
  }
}

/// The mean of dt(dt(u)) = c^2 lap(u) drifts linearly: a double eigenvalue 1.
TEST(AtRest, MeansOfWavesOnSmallRingsLimitNothing) {
  for (const double c : {1.0, 1.34, 0.77, 2.9}) {
    for (const int cells : {5, 8, 12, 20, 24}) {
      const auto limit = [&](const std::string& time) {
        return verdict_on_ring(fmt::format("field u; dt(dt(u)) = {}^2*lap(u)", c), "time = " + time,
                               fmt::format("{}, periodic\n  initial u = cos(2*pi*x)\n  initial dt(u) = 0\n"
                                           "  time 0 .. 1, step 1/1000",
                                           cells))
            .limit.step;
      };
      const double fastest = 2 * c * cells * std::sin(std::numbers::pi * (cells / 2) / cells);
      EXPECT_NEAR(limit("verlet"), 2 / fastest, 2e-4 / fastest) << c << " " << cells;
      EXPECT_NEAR(limit("rk4"), 2 * std::numbers::sqrt2 / fastest, 3e-4 / fastest) << c << " " << cells;
      EXPECT_NEAR(limit("ssp_rk3"), std::sqrt(3) / fastest, 2e-4 / fastest) << c << " " << cells;
    }
  }
}

/// With other terms semi-Lagrangian steps are unstable in narrow intervals: none of them lies below the limit.
TEST(AlongFlow, NoWindowOfUnstableStepsIsBelowTheLimit) {
  struct Case {
    const char *advect, *time;
    int cells;
    double v, nu, k;
  };
  for (const Case& c : {Case{"semi_lagrangian", "euler", 9, 0.94, 0.0169, 1.69},
                        {"semi_lagrangian(cubic)", "rk4", 7, 1.23, 0.0109, 2.42},
                        {"semi_lagrangian(cubic)", "rk2", 16, 1.7, 0.004, 6}}) {
    const auto session = open_scene(fmt::format(
        "model m {{ field u; dt(u) = -advect({}, u) + {}*lap(u) - {}*u }}\nscheme c {{ advect = {}; time = {} }}\n"
        "scene s : m with c {{ grid x = 0 .. 1, cells {}, periodic; initial u = noise(1); time 0 .. 1, step 0.001 }}\n",
        c.v, c.nu, c.k, c.advect, c.time, c.cells));
    const StabilityReport verdict = verdict_of(*session);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    for (int part = 10; part < 50; ++part) {
      const double step = part / 50.0 * verdict.limit.step;
      EXPECT_TRUE(try_step(*session, step, {.steps = 2000}).value().is_stable) << c.cells << " " << step;
    }
  }
}

TEST(AtRest, PulsesInTimeAreSeen) {
  for (const double at : {4.5, 5.0, 7.123}) {
    const StabilityReport verdict =
        verdict_on_ring(fmt::format("field u; dt(u) = (0.01 + 50*exp(-((t - {})/0.02)^2))*lap(u)", at), "time = euler",
                        "20, periodic\n  initial u = sin(2*pi*x)\n  time 0 .. 10, step 1/100");
    EXPECT_FALSE(verdict.is_exact);
    EXPECT_LT(verdict.limit.step, 1e-4) << at;
  }
  EXPECT_TRUE(verdict_on_ring("field u; dt(u) = lap(u)", "time = ab2",
                              "40, periodic\n  initial u = 1\n  time 0 .. 1, step 1/10000")
                  .is_exact);
}

}  // namespace
}  // namespace dpde::stability
