// SPDX-License-Identifier: Apache-2.0
// Examples with networks, some smaller than in their folders.
#include <regex>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class NetworkExamples : public Command {
 protected:
  std::string example(const std::string& file) const {
    return content(fs::path(DPDE_SOURCE_DIR) / "dsl-examples" / file);
  }
};

/// The data were made with the law k(u) = 0.01 + 0.05 u^2: it is recovered from the decay of a profile.
TEST_F(NetworkExamples, AClosureIsTheLawThatMadeTheData) {
  write("law.dpde", example("closure/law.dpde"));
  const Json cost = dpde("check law.dpde guess --json").json()["networks"]["law"];
  EXPECT_EQ(cost["weights"], 1 * 8 + 8 + 8 * 8 + 8 + 8 * 1 + 1);
  EXPECT_EQ(cost["multiplications_per_point"], 8 + 64 + 8);
  const Outcome found = dpde("optimize law.dpde recover --out out --json");
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_LT(found.json()["test"]["error"].get<double>(), 2e-4);
  const Outcome look = dpde("run law.dpde look --json");
  ASSERT_EQ(look.status, 0) << look.err;
  EXPECT_LT(look.json()["error"]["k"]["l2"].get<double>(), 3e-4);
}

/// Start values of solves, on a smaller grid and after a shorter training: iterations and seconds of each are reported,
/// and old solutions save more iterations than the trained guess.
TEST_F(NetworkExamples, GuessesOfSolvesAreCompared) {
  if (!is_thorough()) return;
  std::string text = example("first_guess/first_guess.dpde");
  for (const auto& [from, to] : {std::pair{"cells 64", "cells 16"},
                                 {"time 0 \\.\\. 3", "time 0 .. 0.5"},
                                 {"from 1 to 1 \\+ 6/128", "from 0.25 to 0.25 + 6/128"},
                                 {"runs 16", "runs 4"},
                                 {"epochs 30", "epochs 10"}})
    text = std::regex_replace(text, std::regex(from), to);
  write("f.dpde", text);
  ASSERT_EQ(dpde("run f.dpde learn --out . --json").status, 0);
  ASSERT_EQ(dpde("optimize f.dpde residual --out residual --json").status, 0);
  ASSERT_EQ(dpde("optimize f.dpde learn_to_point --out point --json").status, 0);
  const auto iterations = [&](const std::string& arguments) {
    const Outcome run = dpde("run f.dpde " + arguments + " --json");
    EXPECT_EQ(run.status, 0) << run.err;
    for (const Json& solve : run.json()["solves"]) {
      if (solve["field"] != "p") continue;
      EXPECT_GT(solve["cpu_s"].get<double>(), 0);
      return solve["iterations"].get<double>() / solve["solves"].get<double>();
    }
    return 0.0;
  };
  const double zero = iterations("box --set guess=none"), learnt = iterations("by_residual"),
               last = iterations("box --set guess=last"), two = iterations("box --set guess=extrapolate"),
               cycles = iterations("box --set guess=none --set preconditioner=multigrid"),
               pointed = iterations("by_point --set guess=none");
  EXPECT_LT(learnt, zero);
  EXPECT_LT(last, learnt);
  EXPECT_LT(two, last);
  EXPECT_LT(cycles, 0.2 * zero);
  EXPECT_LT(pointed, 0.8 * zero);
  EXPECT_LT(cycles, pointed);
}

/// A coarse grid compared with averages of runs on a finer one, for new waves; shorter than the example, and with a
/// finer grid half as fine.
TEST_F(NetworkExamples, ASmallNetworkMakesACoarseGridBetter) {
  if (!is_thorough()) GTEST_SKIP() << "at night: by day the wake has one";
  std::string text = example("forced_burgers/forced_burgers.dpde");
  for (const auto& [from, to] : {std::pair{"cells 128", "cells 64"},
                                 {"coarsen 2", "coarsen 1"},
                                 {"coarsen 4", "coarsen 2"},
                                 {"trials 3", "trials 2"},
                                 {", cubic_64[^\n]*\\.nc\"\\)", ""},
                                 {"runs 10", "runs 4"},
                                 {"runs 5", "runs 2"},
                                 {"to 22.9", "to 8"},
                                 {"epochs 12", "epochs 8"},
                                 {"for 199 steps", "for 50 steps"}}) {
    text = std::regex_replace(text, std::regex(from), to);
  }
  write("f.dpde", text);
  for (const char* set : {"learn", "unseen", "unseen_64"})
    ASSERT_EQ(dpde(std::string("run f.dpde ") + set + " --out . --json").status, 0);
  const Outcome learned = dpde("optimize f.dpde through --out out --json --beside-named-only");
  ASSERT_EQ(learned.status, 0) << learned.err;
  const Json error = learned.json()["test"]["error"];
  EXPECT_LT(error["mean"].get<double>(), 0.9 * error["start"]["mean"].get<double>());
  EXPECT_EQ(error["trials"]["each"].size(), 2U);
  EXPECT_NEAR(error["beside"]["plain"]["mean"].get<double>(), error["start"]["mean"].get<double>(), 1e-6)
      << "an untrained network corrects nothing";
  EXPECT_NEAR(error["beside"]["plain_64"]["mean"].get<double>(), 0, 1e-6) << "what made the data";
  const Json energy = learned.json()["statistic"]["energy"], rate = learned.json()["growth"]["rate"];
  EXPECT_NEAR(energy["beside"]["plain"]["mean"].get<double>(), energy["start"]["mean"].get<double>(), 1e-6);
  EXPECT_LT(std::abs(energy["mean_difference"].get<double>()),
            std::abs(energy["start"]["mean_difference"].get<double>()))
      << "linear interpolation takes energy away";
  EXPECT_NEAR(rate["beside"]["plain"]["mean"].get<double>(), rate["start"]["mean"].get<double>(), 1e-4);
  if (!testing::is_thorough()) return;  // judging each of the chart's methods takes two seconds
  // The chart of the same training: in addition to the task's schemes seven more, on the network's grid; another one is
  // on that of the data. Their times decide which ones have a version in single precision.
  const Json chart = dpde("chart f.dpde through --out out --json --samples 1 --sample-seconds 0").json(),
             points = chart["points"];
  EXPECT_EQ(std::ranges::count_if(points,
                                  [](const Json& point) {
                                    return point["scene"].get<std::string>().find("real=f32") == std::string::npos;
                                  }),
            2 + 4 + 7);
  EXPECT_EQ(points[0]["error"], error["trials"]["each"][0]["mean"]);
  EXPECT_EQ(std::ranges::count_if(points, [](const Json& point) { return point["stable"] == false; }), 4)
      << "central differences and upwind5 at this step";
  const auto maker = std::ranges::find_if(points, [](const Json& point) { return point["scene"] == "plain_64"; });
  EXPECT_TRUE(maker != points.end() && maker->at("made_data"));
  EXPECT_NE(chart["best_plain"]["error"]["most_accurate"]["scene"], "plain_64") << "what made the data";
}

const std::string corrected = R"(
network n(u) { initial he, seed 1; conv 2, 3; tanh; conv out, 3, gain = 0.1 }
network other(u) { initial he, seed 2; conv 2, 3; tanh; conv out, 3, gain = 0.1 }
model m { field u; dt(u) = 0.01*lap(u) }
scene trained : m { grid x = 0 .. 1, cells 8, periodic; initial u = x; time 0 .. 1, step 0.1; after step: u += n(u) + 0*other(u) }
task make : trained { learn n; learn other; minimise mean(u^2); using lbfgs, iterations 1 }
scene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = x; time 0 .. 1, step 0.1; after step: u += n(u); n = load("w.safetensors") }
)";

/// A run half with one set of weights and half with another would be meaningless.
TEST_F(NetworkExamples, ARunDoesNotGoOnWithOtherWeights) {
  write("c.dpde", corrected);
  ASSERT_EQ(dpde("optimize c.dpde make --out o --json").status, 0);
  fs::copy(path("o/n.safetensors"), path("w.safetensors"));
  ASSERT_EQ(dpde("run c.dpde s --set end=0.5 --checkpoint-every 1 --out r --json").status, 0);
  EXPECT_EQ(dpde("run c.dpde s --out r --resume --json").json()["resumed_steps"], 5);
  std::string bytes = content(path("w.safetensors"));
  bytes[bytes.size() - 2] = static_cast<char>(bytes[bytes.size() - 2] ^ 1);
  write("w.safetensors", bytes);
  ASSERT_EQ(dpde("run c.dpde s --set end=0.5 --checkpoint-every 1 --out q --json").status, 0);
  fs::copy(path("o/n.safetensors"), path("w.safetensors"), fs::copy_options::overwrite_existing);
  EXPECT_EQ(dpde("run c.dpde s --out q --resume --json").codes(), std::vector<std::string>{"E0914"});
}

/// A term that is 0 is dropped, and the network in it learns nothing.
TEST_F(NetworkExamples, ANetworkInADroppedTermHasNoGradient) {
  write("c.dpde", corrected);
  const Outcome outcome = dpde("gradient c.dpde make --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_GT(outcome.json()["gradient"]["n"]["norm"].get<double>(), 0);
  EXPECT_EQ(outcome.json()["gradient"]["other"]["norm"], 0);
}

/// It has nothing to learn or to set, but it runs.
TEST_F(NetworkExamples, ANetworkMayHaveNoWeights) {
  write("p.dpde",
        "network n(u) { mean_pool 2; upsample 2; relu }\nmodel m { field u; dt(u) = n(u) - u }\n"
        "scene s : m { grid x = 0 .. 1, cells 7, periodic; initial u = x; time 0 .. 0.1, step 0.1 }\n");
  for (const char* backend : {"jit", "interpreter"}) {
    const Outcome run = dpde(std::string("run p.dpde s --json --backend ") + backend);
    EXPECT_EQ(run.status, 0) << run.err;
  }
}

TEST_F(NetworkExamples, NamesAndOptionsThatDoNotFit) {
  const auto codes = [&](std::string text, const std::string& command) {
    write("c.dpde", std::regex_replace(text, std::regex("other"), "u"));
    return dpde(command).codes();
  };
  EXPECT_EQ(codes(corrected, "check c.dpde trained --json"), std::vector<std::string>{"E0359"});
  write("c.dpde", corrected);
  const Outcome outcome = dpde("optimize c.dpde make --epochs 3 --json");
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0904"});
  EXPECT_NE(outcome.err.find("task make"), std::string::npos) << outcome.err;
}

/// The scene of a task that loads weights runs with them.
TEST_F(NetworkExamples, ARunOfATaskTakesItsWeights) {
  std::string text =
      std::regex_replace(corrected, std::regex("scene s : m .*\n"),
                         "task use : trained { learn n from \"o/n.safetensors\"; minimise mean(u^2) }\n");
  text = std::regex_replace(text, std::regex("initial u = x; time 0 .. 1"),
                            "initial u = x; observe e = mean(u^2); time 0 .. 1");
  write("c.dpde", std::regex_replace(text, std::regex("iterations 1"), "iterations 8"));
  ASSERT_EQ(dpde("optimize c.dpde make --out o --json").status, 0);
  const auto energy = [&](const std::string& name) {
    return dpde("run c.dpde " + name + " --json").json()["observables"]["e"].get<double>();
  };
  EXPECT_NE(energy("use"), energy("trained"));
  EXPECT_NEAR(energy("use"), dpde("gradient c.dpde use --json").json()["loss"].get<double>(), 1e-6 * energy("use"));
}

}  // namespace
}  // namespace dpde::testing
