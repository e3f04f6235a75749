// SPDX-License-Identifier: Apache-2.0
// A trained network on a chart, compared with automatically chosen plain methods, including the cost of data and
// training.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

const std::string scenes = R"(
model burgers { field u; param nu; param a; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain {
  grid x = 0 .. 2*pi, cells 64, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/64
}
scene coarse : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/16
}
scene middle : burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/32
}
dataset train : fine { runs 4; seed 1; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4; file "train.nc" }
dataset unseen : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4; file "unseen.nc" }
dataset unseen_32 : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 2; file "unseen_32.nc" }
network corrector(u) { initial he, seed 5; conv 4, 5; tanh; conv out, 5, gain = 0.01 }
scene hybrid : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/16
  after step: u += corrector(u)
}
)";

std::string learn(const std::string& beside, const std::string& epochs = "4") {
  return scenes + "task learn : hybrid { data r = trajectories(\"train.nc\", u); learn corrector; minimise " +
         "mean((u - r)^2) over 4 steps\n  using adam(rate = 3e-3), batch 8, seed 3, epochs " + epochs +
         "\n  test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps" + beside + " }\n";
}
const std::string quick = " --samples 1 --sample-seconds 0";
const std::string both = " beside coarse, middle on trajectories(\"unseen_32.nc\")";

class TrainingChart : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("f.dpde", learn(both));
    for (const char* set : {"train", "unseen", "unseen_32"})
      ASSERT_EQ(dpde(std::string("run f.dpde ") + set + " --out . --json").status, 0);
  }
  static Json point(const Json& chart, const std::string& scene) {
    for (const Json& each : chart["points"]) {
      if (each["scene"] == scene) return each;
    }
    ADD_FAILURE() << "no " << scene << " in " << chart["points"];
    return {};
  }
};

/// Their times decide which of the best methods have such versions.
bool is_cheaper(const Json& point) { return point["scene"].get<std::string>().find("real=f32") != std::string::npos; }

TEST_F(TrainingChart, HasPlainMethodsThatNobodyNamed) {
  const Outcome outcome = dpde("chart f.dpde learn --out o --json" + quick);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json chart = outcome.json();
  std::set<std::string> methods;
  for (const Json& each : chart["points"]) {
    methods.insert(each["method"]);
  }
  EXPECT_EQ(methods.size(), 1U + 1 + 4) << "the network, the scene's own, differences of order 2 and 4 by ssp_rk3, rk4";
  EXPECT_EQ(point(chart, "hybrid")["network"], true);
  // Alternative computation: a task of the plain scene without unknowns, with the method in its scheme.
  write("p.dpde", scenes +
                      "task nothing : coarse {\n  data r = trajectories(\"unseen.nc\", u)\n  unknown nu from 0.3\n"
                      "  minimise mean((u - r)^2) over 1 steps\n  using adam(rate = 1e-300), epochs 1\n"
                      "  test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps\n}\n");
  const Json nothing =
      dpde("optimize p.dpde nothing --json --set dx=central4 --set lap=central4 --set time=rk4").json();
  const Json better = point(chart, "coarse by dx=central4 lap=central4 time=rk4");
  EXPECT_EQ(better["error"], nothing["test"]["err"]["start"]["mean"]);
  EXPECT_LT(better["error"].get<double>(), 0.5 * point(chart, "coarse")["error"].get<double>());
  EXPECT_EQ(better["method"], point(chart, "middle by dx=central4 lap=central4 time=rk4")["method"]) << "one curve";
  double least = INFINITY;
  for (const Json& each : chart["points"]) {
    if (!each["network"].get<bool>()) least = std::min(least, each["error"].get<double>());
  }
  EXPECT_EQ(chart["best_plain"]["err"]["most_accurate"]["error"].get<double>(), least);
  const std::string table = content(path("o/err_chart.csv"));
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(table, '\n')), 1 + chart["points"].size());
}

/// A sine advected by the wind, in steps of 2 with 16 cells: five cells per step, for which only the semi-Lagrangian
/// scheme is stable. RK4 with central(4) is stable up to 2.828 h/1.372 = 0.81 (numerics.md, table 1.1): frames 2 apart
/// take 3 steps at 0.9 of that, and 6 at half of it.
TEST_F(TrainingChart, GivesPlainMethodsStepsThatTheyBear) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const std::string grid = "{\n  grid x = 0 .. 2*pi, cells 16, periodic\n  c = 1; a = 1\n  initial u = a*sin(x)\n";
  write("w.dpde",
        "model wind { field u; param c; param a; dt(u) = -advect(c, u) }\nscheme semi { advect = semi_lagrangian; time "
        "= euler }\nscheme fine { advect = central(8); time = rk4 }\nscene true : wind with fine " +
            grid + "  time 0 .. 8, step 1/8\n}\nscene plain : wind with semi " + grid +
            "  time 0 .. 8, step 2\n}\nscene hybrid : wind with semi " + grid +
            "  time 0 .. 8, step 2\n  after step: u += corrector(u)\n}\n"
            "dataset some : true { runs 2; seed 1; vary a in 0.5 .. 1.5; frames every 2; file \"some.nc\" }\n"
            "network corrector(u) { initial he, seed 5; conv 2, 3; tanh; conv out, 3, gain = 0.01 }\n"
            "task learn : hybrid {\n  data r = trajectories(\"some.nc\", u)\n  learn corrector\n"
            "  minimise mean((u - r)^2) over 1 steps\n  using adam(rate = 1e-3), batch 2, epochs 1\n"
            "  test err = mean(abs(u - r)) on trajectories(\"some.nc\") for 4 steps beside plain\n}\n");
  ASSERT_EQ(dpde("run w.dpde some --out . --json").status, 0);
  const Outcome outcome = dpde("chart w.dpde learn --json" + quick);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json chart = outcome.json();
  EXPECT_EQ(std::ranges::count_if(chart["points"], std::not_fn(is_cheaper)), 1 + 1 + 7 * 2)
      << "each of seven methods with two steps";
  for (const Json& each : chart["points"]) EXPECT_TRUE(each["stable"].get<bool>()) << each;
  const std::string method = "plain by advect=central4 time=rk4";
  const Json long_steps = point(chart, "plain by advect=central4 step=0.6667 time=rk4"),
             short_steps = point(chart, "plain by advect=central4 step=0.3333 time=rk4");
  EXPECT_EQ(long_steps["method"], method);
  EXPECT_EQ(short_steps["method"], method) << "one curve";
  EXPECT_LT(short_steps["error"].get<double>(), long_steps["error"].get<double>());
}

/// The scene that made the data reproduces them up to rounding: this is not an error, and nothing is compared with it.
TEST_F(TrainingChart, WhatMadeTheDataIsNoCompetitor) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("g.dpde", learn(both + ", fine on trajectories(\"unseen_64.nc\")"));
  std::string text = content(path("g.dpde"));
  text.insert(text.find("network"),
              "dataset unseen_64 : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16;"
              " file \"unseen_64.nc\" }\n");
  write("g.dpde", text);
  ASSERT_EQ(dpde("run g.dpde unseen_64 --out . --json").status, 0);
  const Json chart = dpde("chart g.dpde learn --json" + quick).json();
  EXPECT_TRUE(point(chart, "fine")["made_data"].get<bool>());
  EXPECT_LT(point(chart, "fine")["error"].get<double>(), 1e-12);
  EXPECT_FALSE(point(chart, "fine")["pareto"].get<bool>());
  for (const Json& each : chart["points"]) {
    if (each["scene"] != "fine") EXPECT_FALSE(each["made_data"].get<bool>()) << each;
  }
  EXPECT_NE(chart["best_plain"]["err"]["most_accurate"]["scene"], "fine");
  const Outcome trained = dpde("optimize g.dpde learn --beside-named-only");
  EXPECT_NE(trained.out.find("; it gives these data but for rounding, and is left out of what follows\n"),
            std::string::npos)
      << trained.out;
  const std::size_t ratios = trained.out.find("  for its time");
  ASSERT_NE(ratios, std::string::npos);
  EXPECT_EQ(trained.out.find("fine", ratios), std::string::npos) << trained.out;
}

/// Break-even counts data and training against the savings per run; never, if a plain method reaches the error in less
/// time.
TEST_F(TrainingChart, CountsDataAndTraining) {
  const Json chart = dpde("chart f.dpde learn --out o --json --sample-seconds 0.01").json(),
             even = chart["test"]["err"]["break_even"];
  EXPECT_GT(even["data_s"].get<double>(), 0);
  EXPECT_GT(even["training_s"].get<double>(), 0);
  const Json at_error = chart["best_plain"]["err"]["at_equal_error"];
  ASSERT_FALSE(at_error.is_null());
  const double saved = at_error["wall_s"].get<double>() - point(chart, "hybrid")["wall_s"].get<double>();
  EXPECT_EQ(even["never"], saved <= 0);
  for (const Json& each : chart["points"]) {
    ASSERT_EQ(each["wall_s_samples"].size(), 5u);
    EXPECT_EQ(each["wall_s"], each["wall_s_samples"][2]) << "the median";
  }
  EXPECT_EQ(chart["best_plain"]["err"]["break_even"]["at_most"], false);
  EXPECT_EQ(chart["best_plain"]["err"]["break_even"]["runs"], even["runs"]);
  if (saved > 0) {
    const double spent = even["data_s"].get<double>() + even["training_s"].get<double>();
    EXPECT_EQ(even["runs"].get<double>(), std::ceil(spent / (2 * saved)));
  }
}

TEST_F(TrainingChart, TakesTheTrainingThatIsThere) {
  const Json trained = dpde("optimize f.dpde learn --out o --json --beside-named-only").json(),
             chart = dpde("chart f.dpde learn --out o --json" + quick).json();
  EXPECT_EQ(chart["resumed_iterations"], trained["iterations"]);
  EXPECT_EQ(point(chart, "hybrid")["error"], trained["test"]["err"]["mean"]);
}

/// Tests also include the plain methods, so that a reader finds the comparison with the result.
TEST_F(TrainingChart, StandsWithTheResult) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const Outcome outcome = dpde("optimize f.dpde learn --out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json all = outcome.json(), test = all["test"]["err"], beside = test["beside"];
  EXPECT_TRUE(std::filesystem::exists(path("o/err_chart.svg")));
  EXPECT_EQ(beside["coarse"]["named"], true);
  EXPECT_EQ(beside["coarse"]["kind"], "central(2)");
  const Json& better = beside["middle by dx=central4 lap=central4 time=rk4"];
  EXPECT_EQ(better["named"], false);
  EXPECT_EQ(better["kind"], "central(4)");
  bool has_single = false;  // of the best ones for their time
  for (const auto& [scene, each] : beside.items()) has_single |= scene.find("real=f32") != std::string::npos;
  EXPECT_TRUE(has_single) << beside;
  // The ratio of errors, by run.
  double logs = 0;
  for (std::size_t run = 0; run < 3; ++run)
    logs += std::log(better["runs"][run].get<double>() / test["runs"][run].get<double>()) / 3;
  EXPECT_NEAR(better["ratio"]["mean"].get<double>(), std::exp(logs), 1e-9 * std::exp(logs));
  EXPECT_LT(better["ratio"]["low"].get<double>(), std::exp(logs));
  EXPECT_GT(better["ratio"]["high"].get<double>(), std::exp(logs));
  EXPECT_EQ(better["ratio"]["runs"], 3);
  EXPECT_EQ(better["ratio"]["seeds"], 1);
  EXPECT_TRUE(test["kinds"].contains("central(2)") && test["kinds"].contains("central(4)")) << test["kinds"];
  // `a` is 1.354 in run 2 of the test, 0.5521 to 0.9438 in the training.
  const Json& outside = test["conditions"]["outside"];
  EXPECT_EQ(outside["a"]["runs"].size(), 1U);
  EXPECT_NEAR(outside["a"]["runs"]["2"].get<double>(), 1.354, 1e-3);
  EXPECT_EQ(test["conditions"]["training_file"], false);
  EXPECT_EQ(test["conditions"]["steps"], 32);
  EXPECT_EQ(test["conditions"]["steps_of_windows"], 4);
  EXPECT_GT(test["conditions"]["own_error"]["u"].get<double>(), 0) << "of differences of order 2";
  EXPECT_EQ(test["failures"]["blown_up"].size(), 0U);
}

/// One run and one seed give no spread; a test on the training data says so.
TEST_F(TrainingChart, SaysWhatATestIsOf) {
  std::string text = learn(" beside coarse");
  text.replace(text.find("runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4"), 6, "runs 1");
  write("one.dpde", text);
  ASSERT_EQ(dpde("run one.dpde unseen --out . --json").status, 0);
  const Outcome one = dpde("optimize one.dpde learn --beside-named-only");
  EXPECT_EQ(one.out.find("+- 0"), std::string::npos) << one.out;
  EXPECT_NE(one.out.find(" over 1 run of unseen.nc"), std::string::npos) << one.out;
  EXPECT_NE(one.out.find("  one run and one seed: "), std::string::npos) << one.out;
  const Json single = dpde("optimize one.dpde learn --beside-named-only --json").json()["test"]["err"];
  EXPECT_TRUE(single["spread"].is_null());
  EXPECT_TRUE(single["beside"]["coarse"]["ratio"]["low"].is_null());
  const std::string unseen = "on trajectories(\"unseen.nc\")";
  std::string own = learn(" beside coarse");
  own.replace(own.find(unseen), unseen.size(), "on trajectories(\"train.nc\")");
  write("own.dpde", own);
  const Outcome known = dpde("optimize own.dpde learn --beside-named-only");
  EXPECT_NE(known.out.find("warning: train.nc is the file that was learnt from\n"), std::string::npos) << known.out;
  // A later frame of a training run, in a separate file.
  std::string later = learn(" beside coarse");
  later.insert(
      later.find("network"),
      "dataset later : fine { runs 1; seed 1; vary a in 0.5 .. 1.5; frames every 1/16 from 1/2; coarsen 4; file "
      "\"later.nc\" }\n");
  later.replace(later.find(unseen + " for 32"), unseen.size() + 7, "on trajectories(\"later.nc\") for 16");
  write("later.dpde", later);
  ASSERT_EQ(dpde("run later.dpde later --out . --json").status, 0);
  const Outcome begun = dpde("optimize later.dpde learn --beside-named-only");
  EXPECT_NE(begun.out.find("warning: run 0 of later.nc begins with a frame that was learnt from\n"), std::string::npos)
      << begun.out;
}

/// Different runs, signed numbers and runs that blow up are not paired; each then gets its own figures.
TEST_F(TrainingChart, ComparesWhatIsPaired) {
  std::string text = learn(both +
                           ", middle_again on trajectories(\"others_32.nc\")\n  test bias = mean(u - r) on "
                           "trajectories(\"unseen.nc\") for 32 steps beside coarse");
  text.insert(text.find("network"),
              "scene middle_again = middle { step 1/16 }\n"
              "dataset others_32 : fine { runs 3; seed 8; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 2; file "
              "\"others_32.nc\" }\n");
  write("pairs.dpde", text);
  ASSERT_EQ(dpde("run pairs.dpde others_32 --out . --json").status, 0);
  const Outcome words = dpde("optimize pairs.dpde learn --beside-named-only --out o");
  EXPECT_NE(words.out.find("; the runs of others_32.nc are others: no ratio"), std::string::npos) << words.out;
  EXPECT_NE(words.out.find("  bias has negative values and is no error to compare by"), std::string::npos) << words.out;
  const Json all = dpde("test pairs.dpde learn --from o --json --beside-named-only").json()["test"],
             beside = all["err"]["beside"];
  EXPECT_EQ(beside["middle_again"]["paired"], false);
  EXPECT_TRUE(beside["middle_again"]["ratio"].is_null());
  EXPECT_EQ(beside["middle"]["paired"], true);
  EXPECT_FALSE(all["bias"].contains("equal_error"));
  for (const auto& [kind, each] : all["err"]["kinds"].items()) {
    const Json paired = each["equal_cost"].is_null() ? Json() : each["equal_cost"]["paired"];
    if (paired.is_null()) continue;
    EXPECT_LE(paired["low"].get<double>(), paired["mean"].get<double>()) << kind;
    EXPECT_GE(paired["high"].get<double>(), paired["mean"].get<double>()) << kind;
  }
  const std::string table = content(path("o/err_beside.csv"));
  EXPECT_NE(table.find(",run_0,run_1,run_2\n"), std::string::npos) << table;
  EXPECT_NE(
      table.find(fmt::format(",{},{},{}\n", beside["middle"]["runs"][0].get<double>(),
                             beside["middle"]["runs"][1].get<double>(), beside["middle"]["runs"][2].get<double>())),
      std::string::npos)
      << table;
}

/// From rest all runs begin alike: with new parameters they are different runs.
TEST_F(TrainingChart, RunsFromRestAreNotThoseLearnt) {
  std::string text =
      "model pushed { field u; param k = 1; param f = 1; dt(u) = -k*u + f*sin(x) }\nscene rest : pushed {\n"
      "  grid x = 0 .. 2*pi, cells 8, periodic\n  initial u = 0\n  time 0 .. 1, step 1/8\n}\n"
      "dataset some : rest { runs 2; vary f in 0.5, 1; frames every 1/8; file \"some.nc\" }\n"
      "dataset more : rest { runs 2; vary f in 0.7, 1; frames every 1/8; file \"more.nc\" }\n"
      "task learn : rest {\n  data r = trajectories(\"some.nc\", u)\n  unknown k from 0.5\n"
      "  minimise mean((u - r)^2) over 1 steps\n  using adam(rate = 1e-2), epochs 1\n"
      "  test err = mean(abs(u - r)) on trajectories(\"more.nc\") for 4 steps\n}\n";
  write("rest.dpde", text);
  for (const char* set : {"some", "more"}) ASSERT_EQ(dpde(std::string("run rest.dpde ") + set + " --out .").status, 0);
  const Json conditions = dpde("test rest.dpde learn --json").json()["test"]["err"]["conditions"];
  EXPECT_EQ(conditions["known_runs"], Json::array({1}));
}

/// If some runs blow up there is no mean error and no comparison: these runs are reported.
TEST_F(TrainingChart, TellsRunsThatBlowUp) {
  std::string text = learn(both);
  text.replace(text.find("u += corrector(u)"), 4, "u += 0.02*u^3 +");
  write("up.dpde", text);
  const Outcome outcome = dpde("test up.dpde learn --beside-named-only");
  const Json test = dpde("test up.dpde learn --beside-named-only --json").json()["test"]["err"];
  EXPECT_EQ(test["mean"], "inf");
  EXPECT_EQ(test["failures"]["blown_up"], Json::array({2})) << test;
  EXPECT_NE(outcome.out.find("  the network blows up in 1 of 3 runs (2)\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(test["beside"]["coarse"]["ratio"].is_null()) << "a ratio of those left would be chosen by the result";
  EXPECT_EQ(outcome.out.find("nan"), std::string::npos) << outcome.out;
}

/// A correlation's figure is a time: larger is better, and the plain scheme's is above the network's.
TEST_F(TrainingChart, ComparesTimesOfCorrelations) {
  std::string text = learn("");
  text.replace(text.rfind("  test err"), std::string::npos,
               "  correlation c = u above 0.9999 on trajectories(\"unseen.nc\") for 32 steps" + both + " }\n");
  write("c.dpde", text);
  const Json c = dpde("test c.dpde learn --beside-named-only --json").json()["correlation"]["c"];
  const auto time_of = [](const Json& each) { return each["time"]["mean"].get<double>(); };
  const auto one = [&](const std::string& scene) { return c["beside"][scene]["mean"].get<double>(); };
  for (const Json& equal : {c["equal_cost"], c["kinds"]["central(2)"]["equal_cost"]}) {
    ASSERT_TRUE(equal["beyond"].get<bool>()) << "both are cheaper than the network: " << c;
    EXPECT_NEAR(equal["time"].get<double>(), std::max(one("coarse"), one("middle")), 1e-9);
    EXPECT_NEAR(equal["ratio"].get<double>(), equal["time"].get<double>() / time_of(c), 1e-9);
    double logs = 0;  // `middle` stays above until the end
    for (const Json& run : c["time"]["runs"]) logs += std::log(2 / run.get<double>()) / 3;
    EXPECT_NEAR(equal["paired"]["mean"].get<double>(), std::exp(logs), 1e-9 * std::exp(logs));
    EXPECT_LT(equal["paired"]["low"], equal["paired"]["mean"]);
    EXPECT_GT(equal["paired"]["high"], equal["paired"]["mean"]);
  }
}

TEST_F(TrainingChart, WhatCannotBe) {
  write("alone.dpde", learn(""));
  const Outcome alone = dpde("chart alone.dpde learn --json");
  EXPECT_EQ(alone.codes(), std::vector<std::string>{"E0916"}) << alone.err;
  const Outcome varied = dpde("chart f.dpde learn --vary dx=central2,central4");
  EXPECT_EQ(varied.status, 2);
  EXPECT_NE(varied.err.find("task learn learns: its chart is of its tests"), std::string::npos) << varied.err;
}

}  // namespace
}  // namespace dpde::testing
