// SPDX-License-Identifier: Apache-2.0
// Steps with networks of one weight each: their growth is known in closed form.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

/// On cells of width 1, by Euler's method; N(u) = weight*u.
StabilityReport verdict_on(const std::string& rate, const std::string& more, double weight, double step) {
  const auto session = open_scene(
      "network N(u: scalar) -> scalar {\n  conv out, 1, initial = zero\n}\nmodel m { field u; dt(u) = " + rate +
      " }\nscheme c { time = euler }\nscene s : m with c {\n  grid x = 0 .. 32, cells 32, periodic\n"
      "  initial u = sin(2*pi*x/32)\n" +
      fmt::format("  time 0 .. {}, step {}\n", 1000 * step, step) + more + "}\n");
  for (auto& [name, weights] : session->workspace().weights()) weights.values.front() = weight;
  EXPECT_EQ(grows_nothing(*session), !verdict_of(*session).is_above());
  return verdict_of(*session);
}

/// The limit does not depend on the scene's step: 0.49 of the limit, a 60th, a 1000th, and four times it.
TEST(NetworkVerdict, LimitsDoNotDependOnTheSceneStep) {
  for (const double step : {0.245, 0.5 / 60, 5e-4, 2.0}) {
    const StabilityReport verdict = verdict_on("lap(u) + N(u)", "", 0, step);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << step;
    EXPECT_NEAR(verdict.limit.step, 0.5, 0.02) << step;
  }
}

/// |1 - (4 - w)*dt| <= 1.
TEST(NetworkVerdict, KnowsWhatANetworkDoesInAnEquation) {
  for (const auto& [weight, limit] : {std::pair(0.0, 0.5), {-3.0, 2.0 / 7}}) {
    const StabilityReport verdict = verdict_on("lap(u) + N(u)", "", weight, 0.1);
    ASSERT_TRUE(verdict.is_analysed()) << verdict.why;
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(verdict.limit.step, limit, 0.02 * limit);
    EXPECT_TRUE(verdict.is_of_networks);
    EXPECT_FALSE(verdict.is_exact);
  }
  const StabilityReport too_long = verdict_on("lap(u) + N(u)", "", -3, 0.4);
  EXPECT_TRUE(too_long.is_above());
  EXPECT_NEAR(too_long.growth, 1.8, 1e-3);  // |1 - 7*0.4|
  EXPECT_FALSE(too_long.ruins_run()) << "an estimate refuses nothing";
}

/// A network that gives the initial guess of a solve does not change the verdict.
TEST(NetworkVerdict, WhatSolvesBeginWithIsNoPartOfAStep) {
  const auto verdict_from = [](const std::string& from) {
    const auto session = open_scene(
        "network N(u: scalar) -> scalar {\n  conv out, 3, initial = he\n}\nmodel m { field u; solve lap(q) - q = -u "
        "for q" +
        from +
        "\n dt(u) = 2*q - 3*u + 0.1*lap(u) }\nscheme c { time = euler; solve = cg(1e-10) }\nscene s : m with c {\n"
        "  grid x = 0 .. 8, cells 16, periodic\n  initial u = sin(pi*x/4)\n  time 0 .. 1, step 0.1\n}\n");
    return verdict_of(*session);
  };
  const StabilityReport without = verdict_from(""), with = verdict_from(" from N(u), u");
  ASSERT_EQ(without.limit.kind, StepLimit::Kind::limit);
  EXPECT_EQ(with.limit.step, without.limit.step);
  EXPECT_EQ(with.is_exact, without.is_exact);
  EXPECT_FALSE(with.is_of_networks);
}

/// Growth by the network alone is not attributed to the scheme.
TEST(NetworkVerdict, ForgivesWhatACorrectionDoes) {
  const StabilityReport verdict = verdict_on("lap(u)", "  after step : u += N(u)\n", 0.5, 0.1);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 0.5, 0.01);
  EXPECT_FALSE(verdict.is_above());
}

}  // namespace
}  // namespace dpde::stability
