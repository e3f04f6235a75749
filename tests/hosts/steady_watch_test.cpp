// SPDX-License-Identifier: Apache-2.0
// Progress and stops of hosts while a run becomes steady, and while the adjoint of where it comes to rest is found.
#include <atomic>
#include <cmath>

#include "hosts/host_support.h"

namespace dpde::testing {
namespace {

constexpr const char* rod_at_rest = R"(
model rod { field u; param k = 1, f = 2; dt(u) = k*lap(u) + f*x }
scene s : rod { grid x = 0 .. 1, cells 12; boundary u: x = 0; initial u = 0; time 0 .. 40, step 1/400, until steady 1e-7 }
task t : s { unknown k; unknown f; minimise (sample(u, at = 0.5) - 0.1)^2; using newton_cg(), iterations 3 }
)";

std::vector<GradientProgress> all_progress(Simulation& sim) {
  std::vector<GradientProgress> seen;
  sim.watch_gradients(
      [&](const GradientProgress& now) {
        seen.push_back(now);
        return true;
      },
      1);
  sim.gradient();
  sim.watch_gradients({});
  return seen;
}

TEST(SteadyWatch, CountsStepsAndProducts) {
  Simulation sim = compile_text(rod_at_rest, {.name = "t"});
  const std::vector<GradientProgress> seen = all_progress(sim);
  ASSERT_GT(seen.size(), 100u);
  EXPECT_FALSE(seen.front().is_back);
  EXPECT_TRUE(seen.back().is_back);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].done, static_cast<std::int64_t>(i) + 1);
    EXPECT_GE(seen[i].total, seen[i].done);
  }
}

/// In the middle of the run, in its last step, in the first product and in a later one.
TEST(SteadyWatch, StopsEverywhere) {
  Simulation sim = compile_text(rod_at_rest, {.name = "t"});
  const double loss = sim.gradient();
  const std::vector<double> bars(sim.gradient_vector().begin(), sim.gradient_vector().end());
  const std::vector<double> product = sim.hessian_vector(std::vector<double>{1, 0.5});
  const std::vector<GradientProgress> seen = all_progress(sim);
  const std::int64_t steps = std::ranges::count(seen, false, &GradientProgress::is_back);
  for (const std::int64_t at : {std::int64_t{5}, steps, steps + 1, steps + 3}) {
    sim.watch_gradients([&](const GradientProgress& now) { return now.done != at; }, 1);
    EXPECT_TRUE(std::isnan(sim.gradient())) << at;
    if (at <= steps) EXPECT_TRUE(std::isnan(sim.loss())) << at;
    const Optimised found = sim.optimise();
    EXPECT_EQ(found.reason, StopReason::observer) << at;
    EXPECT_EQ(found.evaluations, 1) << at;
  }
  for (const bool is_back : {false, true}) {
    sim.watch_gradients([&](const GradientProgress& now) { return now.is_back != is_back; }, 1);
    for (const double value : sim.hessian_vector(std::vector<double>{1, 0.5})) EXPECT_TRUE(std::isnan(value));
  }
  sim.watch_gradients({});
  EXPECT_EQ(sim.gradient(), loss);
  EXPECT_TRUE(std::equal(bars.begin(), bars.end(), sim.gradient_vector().begin()));
  EXPECT_EQ(sim.hessian_vector(std::vector<double>{1, 0.5}), product);
}

/// As Ctrl-C sets it, while the steps are made and while the adjoint is solved for.
TEST(SteadyWatch, TheFlagStopsBothWays) {
  std::atomic<bool> stop{false};
  Simulation sim = compile_text(rod_at_rest, {.name = "t", .stop = &stop});
  const double loss = sim.gradient();
  for (const bool is_back : {false, true}) {
    int behind = 0;
    sim.watch_gradients(
        [&](const GradientProgress& now) {
          behind += stop ? 1 : 0;
          stop = stop || now.is_back == is_back;
          return true;
        },
        1);
    EXPECT_TRUE(std::isnan(sim.gradient())) << is_back;
    EXPECT_EQ(behind, 0) << is_back;
    stop = false;
  }
  sim.watch_gradients({});
  EXPECT_EQ(sim.gradient(), loss);
}

/// run() ends there and run_to() does not; in steps by progress, by hand before, and anew.
TEST(SteadyWatch, RunsEndWhereTheyAreSteady) {
  Simulation sim = compile_text(rod_at_rest, {.name = "s"});
  ASSERT_TRUE(sim.run());
  const int steps = sim.steps_done();
  const std::vector<double> rest = sim.state("u");
  ASSERT_LT(steps, 4000);
  ASSERT_TRUE(sim.step());
  double change = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) change = std::max(change, std::abs(sim.state("u")[i] - rest[i]));
  EXPECT_LE(change * 400, 1e-7);
  sim.reset();
  ASSERT_TRUE(sim.step(70));
  int calls = 0;
  ASSERT_TRUE(sim.run([&](const Progress& at) { return ++calls, at.step <= at.steps; }, 50));
  EXPECT_EQ(calls, (steps - 70 + 49) / 50);
  EXPECT_EQ(sim.steps_done(), steps);
  EXPECT_EQ(sim.state("u"), rest);
  ASSERT_TRUE(sim.run_to(20));
  EXPECT_EQ(sim.steps_done(), 8000);
}

TEST(SteadyWatch, ARunThatIsNotSteadyInTheEndSaysSo) {
  Simulation sim = compile_text(rod_at_rest, {.name = "s", .set = {{"end", "0.5"}}});
  for (const bool is_watched : {false, true}) {
    sim.reset();
    try {
      is_watched ? sim.run([](const Progress&) { return true; }, 7) : sim.run();
      FAIL();
    } catch (const NoSolution& error) {
      EXPECT_NE(std::string(error.what()).find("after 200 steps (t = 0.5) the state is not steady: it changes by"),
                std::string::npos)
          << error.what();
    }
    EXPECT_EQ(sim.steps_done(), 200);
    EXPECT_GT(sim.state("u")[5], 0);
  }
}

}  // namespace
}  // namespace dpde::testing
