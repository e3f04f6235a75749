// SPDX-License-Identifier: Apache-2.0
// Limits between walls, and runs below and above them.
#include "stability/trial.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/frozen/frozen_points.h"
#include "stability/stability_report.h"
#include "stability/stability_support.h"

namespace dpde::stability {
namespace {

std::unique_ptr<driver::Session> open(const std::string& text, DiagnosticSink& sink) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "s";
  options.backend = driver::Backend::jit;
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  if (!compiled) return nullptr;
  return driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(*compiled)), {}, sink);
}

/// Of the scene's own grid where that is small, else of one with fewer cells.
TEST(WallLimit, IsFoundByRuns) {
  for (const auto& [side, cells] : {std::pair<std::string, int>{"zero_gradient", 32},
                                    {"0", 32},
                                    {"mixed(1, 1, 0)", 32},
                                    {"zero_gradient", 320},
                                    {"0", 320},
                                    {"mixed(1, 1, 0)", 320}}) {
    DiagnosticSink sink;
    const std::unique_ptr<driver::Session> session =
        open(fmt::format("model m {{ field u; dt(u) = lap(u) }}\nscheme c {{ time = euler }}\nscene s : m with c {{\n"
                         "  grid x = 0 .. {0}, cells {0}\n  boundary u: x = {1}\n  initial u = sin(2*pi*x/{0})\n"
                         "  time 0 .. 1, step 0.1\n}}\n",
                         cells, side),
             sink);
    for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message;
    ASSERT_NE(session, nullptr);
    const StabilityReport verdict = verdict_of(*session);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_EQ(verdict.is_exact, cells == 32);
    EXPECT_EQ(verdict.is_of_grid, cells == 32);
    const Search found = search_limit(*session, verdict.limit.step, 2e-3, 3, {.steps = 20000});
    EXPECT_NEAR(found.largest, verdict.limit.step, (cells == 32 ? 0.003 : 0.02) * verdict.limit.step) << side;
  }
}

/// Leapfrog between an inflow and an outflow: the scheme's parasitic mode grows at every step.
TEST(WallLimit, OfLeapfrogAtAnOutflowIsNone) {
  DiagnosticSink sink;
  const std::unique_ptr<driver::Session> session = open(
      "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = central(2); time = leapfrog }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 64\n  boundary u: x.low = 0, x.high = zero_gradient\n"
      "  initial u = exp(-100*(x - 0.3)^2)\n  time 0 .. 4, step 1/128\n}\n",
      sink);
  ASSERT_NE(session, nullptr);
  const StabilityReport verdict = verdict_of(*session);
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never);
  EXPECT_TRUE(verdict.is_of_walls);
  EXPECT_FALSE(try_step(*session, 1.0 / 128, {}).value().is_stable);
}

/// The fastest place is in the middle, where the wind blows to x.high. It blows out at x.low, where it is slower, with
/// a slope of 0 there: that is a place of its own.
TEST(WallLimit, IsLookedForWhereFieldsAreSmallestAndLargest) {
  const auto verdict_with = [](const std::string& low, double* growth) {
    DiagnosticSink sink;
    const std::unique_ptr<driver::Session> session = open(
        "model m { field u; coefficient c; dt(u) = -c*dx(u) }\nscheme l { time = leapfrog }\nscene s : m with l {\n"
        "  grid x = 0 .. 1, cells 320\n  c = 3*exp(-50*(x - 0.5)^2) - 1\n  boundary u: x.low = " +
            low + ", x.high = 0\n  initial u = exp(-100*(x - 0.3)^2)\n  time 0 .. 4, step 1/2500\n}\n",
        sink);
    const StabilityReport verdict = verdict_of(*session);
    EXPECT_EQ(verdict.places_between_walls, 2);
    EXPECT_GT(verdict.places, 4);
    if (growth == nullptr) return verdict;
    EXPECT_FALSE(try_step(*session, 1.0 / 2500, {.steps = 20000}).value().is_stable);
    *growth = growths_at(*session, verdict, {1.0 / 2500}).front();
    return verdict;
  };
  double growth = 0;
  const StabilityReport open_end = verdict_with("zero_gradient", &growth);
  EXPECT_EQ(open_end.limit.kind, StepLimit::Kind::never);
  EXPECT_TRUE(open_end.is_of_walls);
  EXPECT_EQ(open_end.place, "x = 0.0015625");
  EXPECT_DOUBLE_EQ(growth, open_end.growth);
  EXPECT_GT(growth, 1.001);
  const StabilityReport closed = verdict_with("0", nullptr);
  EXPECT_EQ(closed.limit.kind, StepLimit::Kind::limit);
  EXPECT_FALSE(closed.is_of_walls);
}

/// Coefficients that grow have no values behind the end of the scene.
TEST(Trial, EndsWithTheSceneWhereStepsChangeWithTime) {
  const auto session = open_scene(
      "model m { field u; dt(u) = 0.1*(1 + t)*lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 16, periodic\n  initial u = sin(2*pi*x)\n  time 0 .. 1, step 1/200\n}\n");
  EXPECT_TRUE(varies_in_time(*session));
  EXPECT_EQ(try_step(*session, 0.005, {.steps = 4000, .most_time = 1}).value().steps, 200);
  EXPECT_FALSE(try_step(*session, 0.005, {.steps = 4000}).value().is_stable) << "at t = 20";
  EXPECT_TRUE(try_step(*session, 0.005, {.steps = 4000, .most_time = 1}).value().is_stable);
}

}  // namespace
}  // namespace dpde::stability
