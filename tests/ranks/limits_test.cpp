// SPDX-License-Identifier: Apache-2.0
// What a grid that is divided among ranks cannot have yet is an error that says so, at all ranks.
#include <gtest/gtest.h>

#include "dpde/runtime/error.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/thread_ranks.h"
#include "ranks/divided_task.h"

namespace dpde::testing {
namespace {

std::string task_of(const std::string& model, const std::string& scheme, const std::string& scene,
                    const std::string& axis = ", periodic") {
  return "model m { field u; param a; " + model + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n" +
         "  grid x = 0 .. 1, cells 12" + axis + "\n  grid y = 0 .. 1, cells 10" + axis +
         "\n  a = 1\n  initial u = a*x*(1 - x)\n" + scene +
         "  time 0 .. 0.04, step 0.01\n}\ntask t : s { unknown a from 1; minimise mean(u^2) at t = 0.04 }\n";
}

std::string error_of(const std::string& text, const Ranks& ranks = {2, 1, 1}, const OpenWith& with = {}) {
  return DividedTask(text, "t", with).error(ranks);
}

void expect_refused(const std::string& error, const std::string& what) {
  EXPECT_NE(error.find("a grid that is divided among ranks cannot have " + what), std::string::npos) << error;
}

/// Each kind of solve by each method, so that none of them finds out alone that it has no solution.
TEST(DividedLimits, SolvesAreRefused) {
  expect_refused(error_of(task_of("dt(u) = 0.1*lap(u)", "time = ars222", "")), "solves");
  expect_refused(error_of(task_of("dt(u) = 0.1*lap(u) - u^3", "time = backward_euler; implicit = all", "")), "solves");
  for (const std::string method : {"automatic", "direct", "fourier", "multigrid", "cg", "bicgstab", "gmres"}) {
    const std::string solve = "; solve = " + method;
    expect_refused(error_of(task_of("dt(u) = 0.1*lap(u)", "time = backward_euler" + solve, "")), "solves");
    expect_refused(error_of(task_of("solve p - lap(p) = u for p; dt(u) = p - u", "time = euler" + solve, "")),
                   "solves");
  }
}

TEST(DividedLimits, TransformsAreRefused) {
  expect_refused(error_of(task_of("dt(u) = 0.1*lap(u)", "lap = spectral; time = rk4", "")), "transforms");
}

TEST(DividedLimits, PolesAreRefused) {
  const std::string text =
      "model m { field u; dt(u) = 0.1*lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n"
      "  coordinates sphere(1)\n  grid lon = 0 .. 2*pi, cells 12, periodic\n  grid lat = -pi/2 .. pi/2, cells 10\n"
      "  boundary u: lat = pole\n  initial u = sin(lat)\n  time 0 .. 0.004, step 0.001\n}\n"
      "task t : s { unknown initial u from cos(lat); minimise mean(u^2) at t = 0.004 }\n";
  expect_refused(error_of(text, {1, 2, 1}), "poles");
}

TEST(DividedLimits, NetworksAreRefused) {
  const std::string network = "network n(u) { initial xavier, seed 1; dense 2; tanh; dense out }\n";
  expect_refused(error_of(network + task_of("dt(u) = n(u)", "time = euler", "")), "networks");
}

TEST(DividedLimits, TheInterpreterIsRefused) {
  expect_refused(
      error_of(task_of("dt(u) = 0.1*lap(u)", "time = euler", ""), {2, 1, 1}, {.backend = driver::Backend::interpreter}),
      "the interpreter");
}

TEST(DividedLimits, RunsUntilSteadyAreRefused) {
  std::string text = task_of("dt(u) = 0.1*lap(u) - a*u + x", "time = euler", "");
  text.replace(text.find("0.04, step 0.01"), 15, "9, step 0.01, until steady 1e-3");
  text.replace(text.find(" at t = 0.04"), 12, "");
  expect_refused(error_of(text), "runs until steady");
}

TEST(DividedLimits, SeveralStepsAtOnceAreRefused) {
  DividedTask task(task_of("dt(u) = 0.1*lap(u)", "time = euler", ""));
  try {
    run_ranks({2, 1, 1}, [&](Communicator& rank) {
      EngineOptions options;
      options.ranks = &rank;
      Engine engine(task.scene(), options, nullptr);
      RolloutSetup setup = engine.setup();
      setup.block_steps = 4;
      const Rollout rollout(std::move(setup));
    });
    ADD_FAILURE();
  } catch (const Error& error) {
    expect_refused(error.what(), "several steps at once");
  }
}

TEST(DividedLimits, ASubgridIsNotNarrowerThanItsHalo) {
  const std::string text = task_of("dt(u) = 0.1*lap(u)", "lap = central(6); time = euler", "");
  EXPECT_EQ(error_of(text, {1, 3, 1}), "");
  EXPECT_EQ(error_of(text, {1, 4, 1}),
            "axis y of 10 cells is divided among 4 ranks: 2 cells for one of them, fewer than its halo of 3");
  EXPECT_EQ(error_of(text, {13, 1, 1}),
            "axis x of 12 cells is divided among 13 ranks: 0 cells for one of them, fewer than its halo of 3");
}

TEST(DividedLimits, AConditionAtASideReadsItsOwnCells) {
  const std::string text = task_of("dt(dt(u)) = lap(u)", "lap = central(4); time = rk4",
                                   "  initial dt(u) = 0\n  boundary u = radiating(1)\n", "");
  EXPECT_EQ(error_of(text, {2, 1, 1}), "");
  EXPECT_EQ(error_of(text, {3, 1, 1}),
            "axis x is divided among ranks, and 4 cells of one are too few for a condition at its side, which reads "
            "others");
}

}  // namespace
}  // namespace dpde::testing
