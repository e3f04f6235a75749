// SPDX-License-Identifier: Apache-2.0
// The examples that train networks, or small versions of them: their results, not only that they run.
#include <cmath>
#include <numeric>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class LearningExamples : public Command {
 protected:
  Json found(const std::string& file, const std::string& task, const std::string& options = "") const {
    const Outcome outcome = dpde("optimize " + file + " " + task + " --out out --threads 1 --json" + options);
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json();
  }
};

/// y^2 = x: data of both roots are averaged to neither; the equation gives one of the roots at all points.
TEST_F(LearningExamples, TwoSolutions) {
  fs::copy(fs::path(DPDE_SOURCE_DIR) / "dsl-examples/two_solutions/two_solutions.dpde", path("t.dpde"));
  const Json examples = found("t.dpde", "examples"), equation = found("t.dpde", "equation");
  EXPECT_NEAR(examples["loss"].back().get<double>(), 0.5, 0.02) << "their variance";
  EXPECT_GT(examples["test"]["residual"].get<double>(), 0.3);
  EXPECT_LT(equation["test"]["residual"].get<double>(), 2e-6);
  ASSERT_EQ(dpde("run t.dpde curves --out out --json").status, 0);
  const NpyArray averaged = read_npy(path("out/averaged.npy")), solved = read_npy(path("out/solved.npy"));
  ASSERT_EQ(solved.values.size(), 200U);
  double mean = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    const double x = (static_cast<double>(i) + 0.5) / 200;
    EXPECT_NEAR(solved.values[i] * (solved.values[199] < 0 ? -1 : 1), std::sqrt(x), x < 0.05 ? 0.03 : 3e-3) << x;
    mean += averaged.values[i] / 200;
  }
  EXPECT_LT(std::abs(mean), 0.1);
}

/// A quarter of the example's data, samples and tests: the learned weights are better than the limiter on the same
/// grid.
TEST_F(LearningExamples, LearnedFlux) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  std::string text = content(DPDE_SOURCE_DIR "/dsl-examples/learned_flux/learned_flux.dpde");
  text = rewritten(text, {{"cells 512", "cells 256"},
                          {"step 0.005", "step 0.01"},
                          {"coarsen 16", "coarsen 8"},
                          {"runs 8", "runs 4"},
                          {"runs 5", "runs 2"},
                          {"to 30", "to 20"},
                          {"to 20; coarsen 8; file \"test", "to 10; coarsen 8; file \"test"},
                          {"over 16 steps", "over 8 steps"},
                          {"unroll (2, 8, 16)", "unroll (2, 8)"},
                          {"for 300 steps", "for 100 steps"}});
  write("t.dpde", text);
  for (const std::string set : {"train", "test"})
    ASSERT_EQ(dpde("run t.dpde " + set + " --out . --json").status, 0) << set;
  const double learned = found("t.dpde", "learn")["test"]["error"]["mean"].get<double>();
  EXPECT_LT(learned, 0.7 * found("t.dpde", "plain_limited")["test"]["error"]["mean"].get<double>());
  EXPECT_LT(learned, 0.3 * found("t.dpde", "plain_first")["test"]["error"]["mean"].get<double>());
}

/// The example on a quarter of the cells, with fewer filters and fields: 98 % of the squared divergence is removed, and
/// the remainder is div(u) - lap(p).
TEST_F(LearningExamples, HelmholtzHodge) {
  std::string text = content(DPDE_SOURCE_DIR "/dsl-examples/helmholtz_hodge/helmholtz_hodge.dpde");
  const std::vector<std::pair<std::string, std::string>> smaller = {
      {"cells 32", "cells 16"},         {"0 .. 32", "0 .. 16"},   {"highest = 16", "highest = 8"},
      {"lowest = 5.1", "lowest = 2.6"}, {"conv 24", "conv 12"},   {"runs 100", "runs 12"},
      {"runs 10;", "runs 3;"},          {"epochs 7", "epochs 40"}};
  text = rewritten(text, smaller);
  write("t.dpde", text);
  for (const std::string set : {"train", "test"})
    ASSERT_EQ(dpde("run t.dpde " + set + " --out . --json").status, 0) << set;
  const Json learnt = found("t.dpde", "learn")["test"];
  EXPECT_LT(learnt["left"]["mean"].get<double>(), 0.02 * learnt["before"]["mean"].get<double>());
  ASSERT_EQ(dpde("run t.dpde picture --out out --json").status, 0);
  const auto values = [&](const std::string& field) { return read_npy(path("out/" + field + ".npy")).values; };
  const std::vector<double> divergence = values("divergence"), p = values("p"), left = values("left");
  ASSERT_EQ(p.size(), 256U);
  double squares = 0, before = 0;
  for (std::size_t j = 0; j < 16; ++j) {
    for (std::size_t i = 0; i < 16; ++i) {
      const auto at = [&](std::size_t dj, std::size_t di) { return p[(j + dj) % 16 * 16 + (i + di) % 16]; };
      const std::size_t here = 16 * j + i;
      EXPECT_NEAR(left[here], divergence[here] - (at(0, 1) + at(0, 15) + at(1, 0) + at(15, 0) - 4 * p[here]), 1e-10);
      squares += left[here] * left[here];
      before += divergence[here] * divergence[here];
    }
  }
  EXPECT_LT(squares, 0.03 * before);
}

/// The goal is reached with two thirds of the force that generated it.
TEST_F(LearningExamples, LeastForceOfBurgers) {
  const Json result = found(DPDE_SOURCE_DIR "/dsl-examples/burgers_control/burgers_control.dpde", "steer");
  EXPECT_LT(result["test"]["miss"].get<double>(), 2e-5);
  double sought = 0, made = 0;
  for (const double force : read_npy(path("out/F.npy")).values) sought += std::abs(force);
  for (int i = 0; i < 32; ++i) made += 32 * 0.946 * std::exp(-std::pow(((i + 0.5) / 32 - 0.42) / 0.195, 2) / 2);
  EXPECT_NEAR(made, 466, 1);
  EXPECT_LT(sought, 0.68 * made);
}

/// With 8 values on 22 x 8 cells: the search ends when no step lowers the loss, long before its 300 iterations. The
/// result has half the drag, the same flow rate, and no backflow.
TEST_F(LearningExamples, LeastPullAtACylinder) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "dsl-examples/incompressible_flow";
  const std::string small = " --set cells.x=22 --set cells.y=8 --set step=0.04";
  fs::copy(folder / "flow.dpde", path("flow.dpde"));
  std::string text = content(folder / "drag.dpde");
  write("t.dpde", text);
  const Json loss = found("t.dpde", "less_pull", small)["loss"];
  EXPECT_LT(loss.size(), 100u);
  EXPECT_LT(loss.back().get<double>(), 0.5 * loss.front().get<double>());
  const std::string parabola = "inflow = 1.2*y*(0.41 - y)/0.41^2";
  ASSERT_NE(text.find(parabola), std::string::npos);
  write("t.dpde", text.replace(text.find(parabola), parabola.size(), "inflow = load(\"out/inflow.npy\")"));
  const Json flow = dpde("run t.dpde pulled --json" + small).json()["observables"];
  EXPECT_NEAR(flow["drag"].get<double>(), loss.back().get<double>(), 0.02);
  EXPECT_NEAR(flow["through"].get<double>(), 0.2, 1e-3);
  EXPECT_GT(flow["slowest"].get<double>(), -2e-3);
}

/// One run of data, samples of 5 units and three iterations instead of four runs, 20 units and six.
TEST_F(LearningExamples, ANetworkHoldsTheFlux) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "dsl-examples/plasma";
  for (const char* file : {"plasma.dpde", "hold.dpde"}) fs::copy(folder / file, path(file));
  std::string text = content(folder / "hold_network.dpde");
  const std::vector<std::pair<std::string, std::string>> smaller = {{"runs 4", "runs 1"},
                                                                    {"from 120 to 200", "from 160 to 200"},
                                                                    {"over 800 steps", "over 200 steps"},
                                                                    {"epochs 6", "epochs 3"}};
  for (const auto& [from, to] : smaller) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  write("t.dpde", text);
  ASSERT_EQ(dpde("run t.dpde coarse_saturated --out . --json").status, 0);
  const Json loss = found("t.dpde", "least_effort_by_network")["loss"];
  EXPECT_LT(loss.back().get<double>(), 0.6 * loss.front().get<double>());
}

/// Two parameters of 25 and 1e-6 of the scene with three models, from one day on a quarter of its cells along each
/// axis. With the result the run continues like the truth and conserves mass, water and dust.
TEST_F(LearningExamples, TwoParametersOfTheWeather) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "dsl-examples/coupled";
  for (const char* file : {"air.dpde", "water.dpde", "ground.dpde"}) fs::copy(folder / file, path(file));
  write("year.dpde", rewritten(content(folder / "year.dpde"), {{"cells 64", "cells 16"}, {"cells 32", "cells 8"}}));
  write("t.dpde", rewritten(content(folder / "observed.dpde"), {{"from 864000 to 950400", "from 86400 to 172800"},
                                                                {"from 954000 to 3546000", "from 176400 to 435600"},
                                                                {"for 720 steps", "for 72 steps"}}));
  for (const std::string set : {"day", "month"})
    ASSERT_EQ(dpde("run t.dpde " + set + " --out . --json").status, 0) << set;
  const Json result = found("t.dpde", "exact", " --beside-named-only");
  EXPECT_NEAR(result["unknowns"]["swell"]["value"].get<double>(), 25, 1e-6);
  EXPECT_NEAR(result["unknowns"]["evaporation"]["value"].get<double>(), 1e-6, 1e-13);
  EXPECT_LT(result["test"]["depth"]["mean"].get<double>(), 1e-6);
  EXPECT_GT(result["test"]["depth"]["start"]["mean"].get<double>(), 1);
  for (const char* kept : {"mass", "water", "dust"})
    EXPECT_LT(std::abs(result["statistic"][kept]["mean_difference"].get<double>()), 1e-13) << kept;
}

/// Two runs on 64 x 64 cells, a closure on 16 x 16: the loss of averages falls by a quarter, and a run of 30 samples
/// from small waves neither blows up nor decays.
TEST_F(LearningExamples, AClosureKeepsTheEnergy) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "dsl-examples/weather";
  fs::copy(folder / "layers.dpde", path("layers.dpde"));
  write("t.dpde", rewritten(content(folder / "eddies.dpde"),
                            {{"runs 8", "runs 2"}, {"load(\"climate/", "load(\"out/"}, {"epochs 2", "epochs 3"}}));
  ASSERT_EQ(dpde("run t.dpde train --out . --json --set cells=64 --set step=0.01 --set nu=1e-5").status, 0);
  const Json learned = found("t.dpde", "climate", " --set cells=16 --beside-named-only");
  const std::vector<double> loss = learned["loss"].get<std::vector<double>>();
  const auto tenth = static_cast<std::ptrdiff_t>(loss.size() / 10);
  const double first = std::accumulate(loss.begin(), loss.begin() + tenth, 0.0);
  EXPECT_LT(std::accumulate(loss.end() - tenth, loss.end(), 0.0), 0.75 * first);
  const Json run = dpde("run t.dpde by_climate --set cells=16 --set end=60 --every 50 --json").json()["observables"];
  for (std::size_t k = 20; k < run["upper_energy"].size(); ++k) {
    EXPECT_GT(run["upper_energy"][k].get<double>(), 3);
    EXPECT_LT(run["upper_energy"][k].get<double>(), 40);
  }
}

/// On 40 x 24 cells, one run instead of three, samples of 24 units: the network and the hand-written law remove the
/// power from vortex shedding at a new Reynolds number, for longer than a sample; a direct search is no worse.
TEST_F(LearningExamples, ACylinderThatTurnsShedsNoVortices) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("t.dpde", rewritten(content(DPDE_SOURCE_DIR "/dsl-examples/incompressible_flow/turned.dpde"),
                            {{"cells 60", "cells 40"},
                             {"cells 36", "cells 24"},
                             {"step 1/16", "step 1/8"},
                             {"runs 3", "runs 1"},
                             {"1/80, 1/100, 1/125", "1/100"},
                             {"runs 4", "runs 1"},
                             {"1/90, 1/100, 1/110, 1/140", "1/110"},
                             {"over 384 steps", "over 192 steps"},
                             {"epochs 25", "epochs 6"},
                             {"for 384 steps", "for 192 steps"},
                             {"for 1024 steps", "for 512 steps"},
                             {"iterations 100", "iterations 10"}}));
  for (const std::string set : {"starts", "unseen"})
    ASSERT_EQ(dpde("run t.dpde " + set + " --out . --json").status, 0) << set;
  double early = 1e9;
  for (const std::string task : {"learn", "by_gains"}) {
    const Json test = found("t.dpde", task)["test"];
    EXPECT_LT(test["late"]["mean"].get<double>(), 0.96 * test["late"]["start"]["mean"].get<double>()) << task;
    EXPECT_LT(test["late_motor"]["mean"].get<double>(), 0.01) << task;
    early = std::min(early, test["early"]["mean"].get<double>());
  }
  EXPECT_LT(found("t.dpde", "direct")["loss"].back().get<double>(), early);
}

/// One run on 64 x 64 cells, for a grid of 16 x 16 and samples of 6 units: numbers and network lower the loss of
/// averages.
TEST_F(LearningExamples, MeansOfAFinerPlasma) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "dsl-examples/plasma";
  fs::copy(folder / "plasma.dpde", path("plasma.dpde"));
  write("t.dpde",
        rewritten(content(folder / "corrector.dpde"), {{"runs 6", "runs 1"}, {"over 200 steps", "over 120 steps"}}));
  const std::string fine = " --set cells=64 --set nu=2e-4 --set step=0.025 --set end=300";
  ASSERT_EQ(dpde("run t.dpde turbulent --out . --json" + fine).status, 0);
  for (const std::string task : {"statistics_by_numbers", "statistics"}) {
    const std::vector<double> loss = found("t.dpde", task, " --set cells=16")["loss"].get<std::vector<double>>();
    const auto quarter = static_cast<std::ptrdiff_t>(loss.size() / 4);
    const double first = std::accumulate(loss.begin(), loss.begin() + quarter, 0.0);
    EXPECT_LT(std::accumulate(loss.end() - quarter, loss.end(), 0.0), 0.8 * first) << task;
  }
}

/// A tenth of the scenes and epochs: for unseen goals the error is less than a third of that without training.
TEST_F(LearningExamples, ControllerOfBurgers) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  std::string text = content(DPDE_SOURCE_DIR "/dsl-examples/burgers_control/controller.dpde");
  const std::vector<std::pair<std::string, std::string>> smaller = {
      {"runs 400", "runs 40"}, {"runs 100", "runs 10"}, {"epochs 60", "epochs 12"}};
  for (const auto& [from, to] : smaller) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  write("t.dpde", text);
  for (const std::string set : {"train", "test"})
    ASSERT_EQ(dpde("run t.dpde " + set + " --out . --json").status, 0) << set;
  const Json miss = found("t.dpde", "learn")["test"]["miss"];
  EXPECT_LT(miss["mean"].get<double>(), miss["start"]["mean"].get<double>() / 3);
}

}  // namespace
}  // namespace dpde::testing
