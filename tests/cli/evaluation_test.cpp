// SPDX-License-Identifier: Apache-2.0
// Evaluation of a training: several trials, comparison with plain schemes, statistics, growth rates.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

const std::string burgers = R"(
model burgers { field u; param nu; param a; param phase; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain {
  grid x = 0 .. 2*pi, cells 64, periodic
  nu = 0.3; a = 1; phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 2, step 1/64
}
scene coarse : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.3; a = 1; phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 2, step 1/16
}
dataset train : fine { runs 4; seed 1; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 4; file "train.nc" }
dataset unseen : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 4; file "unseen.nc" }
)";

std::string network(int seed) {
  return "network corrector(u) { initial he, seed " + std::to_string(seed) +
         "; conv 4, 5; tanh; conv out, 5, gain = 0.01 }\n";
}

/// A correction for the coarse grid, with `options` of the training and `tests`.
std::string correcting(
    const std::string& options,
    const std::string& tests = "test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps",
    int network_seed = 5) {
  return burgers + network(network_seed) +
         "scene hybrid : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; phase = 0; "
         "initial u = a*sin(x) + 0.3*cos(2*x + phase)\n"
         "  time 0 .. 2, step 1/16; after step: u += corrector(u) }\n"
         "task learn : hybrid { data r = trajectories(\"train.nc\", u); learn corrector; minimise mean((u - r)^2) over "
         "4 steps\n"
         "  using adam(rate = 3e-3), batch 8, " +
         options + "\n  " + tests + " }\n";
}

class Evaluation : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("data.dpde", burgers);
    for (const std::string set : {"train", "unseen"}) {
      const Outcome made = dpde("run data.dpde " + set + " --out . --json");
      ASSERT_EQ(made.status, 0) << made.out << made.err;
    }
  }
  Outcome learn(const std::string& text, const std::string& arguments) const {
    write("t.dpde", text);
    return dpde("optimize t.dpde learn --json --beside-named-only " + arguments);
  }
};

// ---- trials --------------------------------------------------------------------------------------------------------

TEST_F(Evaluation, TrialsAreTrainingsWithTheNextSeeds) {
  const std::string rest = ", epochs 4, unroll (2, 4), validate 0.25, noise 0.01";
  const Outcome outcome = learn(correcting("seed 3, trials 3" + rest), "--out o");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json all = outcome.json();
  ASSERT_EQ(all["trials"].size(), 3U);
  double sum = 0, least = INFINITY;
  std::size_t best = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int more = static_cast<int>(k);
    const Json alone =
        learn(correcting("seed " + std::to_string(3 + more) + rest,
                         "test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps", 5 + more),
              "--out o" + std::to_string(k))
            .json();
    EXPECT_EQ(all["trials"][k]["seed"], 3 + more);
    EXPECT_EQ(all["trials"][k]["loss"], alone["loss"]) << k;
    EXPECT_EQ(all["trials"][k]["epochs"], alone["epochs"]) << k;
    EXPECT_EQ(all["test"]["err"]["trials"]["each"][k]["course"], alone["test"]["err"]["course"]) << k;
    EXPECT_EQ(all["test"]["err"]["trials"]["each"][k]["mean"], alone["test"]["err"]["mean"]) << k;
    sum += alone["test"]["err"]["mean"].get<double>();
    if (alone["best"]["loss"].get<double>() < least) best = k;
    least = std::min(least, alone["best"]["loss"].get<double>());
  }
  EXPECT_EQ(all["best_trial"], best + 1) << "by validation";
  EXPECT_EQ(all["loss"], all["trials"][best]["loss"]);
  EXPECT_EQ(all["test"]["err"]["course"], all["test"]["err"]["trials"]["each"][best]["course"]);
  EXPECT_EQ(content(path("o/corrector.safetensors")),
            content(path("o" + std::to_string(best) + "/corrector.safetensors")));
  EXPECT_NE(content(path("o/corrector.safetensors")),
            content(path("o" + std::to_string((best + 1) % 3) + "/corrector.safetensors")));
  const Json over = all["test"]["err"]["trials"];
  EXPECT_NEAR(over["mean"].get<double>(), sum / 3, 1e-12);
  double squares = 0;
  for (const Json& each : over["each"]) squares += std::pow(each["mean"].get<double>() - sum / 3, 2);
  EXPECT_NEAR(over["spread"].get<double>(), std::sqrt(squares / 2), 1e-12);
  const std::string table = content(path("o/err.csv"));
  EXPECT_EQ(table.substr(0, table.find('\n')),
            "t,err,err_spread,err_at_start,err_at_start_spread,err_of_trial_1,err_of_trial_2,err_of_trial_3,err_of_"
            "trials,err_of_trials_spread");
  EXPECT_EQ(std::ranges::count(content(path("o/loss.csv")), '\n'),
            1 + 3 * static_cast<std::ptrdiff_t>(all["loss"].size()));
}

TEST_F(Evaluation, AFileGivesAllTrialsTheSameWeights) {
  ASSERT_EQ(learn(correcting("epochs 1"), "--out o").status, 0);
  std::string text = correcting("seed 3, epochs 1, trials 2");
  text.replace(text.find("learn corrector;"), 16, "learn corrector from \"o/corrector.safetensors\";");
  const Json same = learn(text, "--epochs 1").json();
  EXPECT_NE(same["trials"][0]["loss"], same["trials"][1]["loss"]) << "another order";
  std::string whole = correcting("seed 3, epochs 1, trials 2");
  whole.replace(whole.find("batch 8"), 7, "batch 100000");
  std::string loaded = text;
  loaded.replace(loaded.find("batch 8"), 7, "batch 100000");
  const Json from_seeds = learn(whole, "").json(), from_file = learn(loaded, "").json();
  EXPECT_NE(from_seeds["trials"][0]["loss"][0].get<double>(), from_seeds["trials"][1]["loss"][0].get<double>());
  EXPECT_NEAR(from_file["trials"][0]["loss"][0].get<double>(), from_file["trials"][1]["loss"][0].get<double>(), 1e-13)
      << "one batch of all windows, in another order";
}

TEST_F(Evaluation, TrialsGoOnToTheSameNumbers) {
  const std::string text = correcting("seed 3, epochs 6, trials 3, noise 0.01, schedule halve(20)");
  const Outcome whole = learn(text, "--out whole");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  // Killed during the second trial.
  shell(
      "$DPDE optimize t.dpde learn --out o --checkpoint-every 2 --json & run=$!; for i in $(seq 6000); do [ $(grep -ao "
      "dpdetrn o/learn.training | wc -l) -ge 2 ] && break; sleep 0.002; done; kill -9 $run; wait $run");
  const std::string half = content(path("o/learn.training"));
  ASSERT_NE(half.find("dpdetrn", half.find("dpdetrn") + 1), std::string::npos) << "the second trial has begun";
  const Outcome rest = dpde("optimize t.dpde learn --out o --resume --json");
  ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
  EXPECT_GT(rest.json()["resumed_iterations"], whole.json()["iterations"]) << "the first trial was over";
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(rest.json()["trials"][k]["loss"], whole.json()["trials"][k]["loss"]) << k;
    EXPECT_EQ(rest.json()["trials"][k]["best"], whole.json()["trials"][k]["best"]) << k;
  }
  EXPECT_EQ(rest.json()["test"], whole.json()["test"]);
  EXPECT_EQ(content(path("o/corrector.safetensors")), content(path("whole/corrector.safetensors")));
  // Later with more epochs and more trials.
  ASSERT_EQ(learn(correcting("seed 3, epochs 3, trials 2, noise 0.01, schedule halve(20)"), "--out more").status, 0);
  const Outcome more = learn(text, "--out more --resume");
  ASSERT_EQ(more.status, 0) << more.out << more.err;
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_EQ(more.json()["trials"][k]["loss"], whole.json()["trials"][k]["loss"]) << k;
  // Another seed is another training.
  EXPECT_EQ(learn(correcting("seed 4, epochs 6, trials 3, noise 0.01, schedule halve(20)"), "--out o --resume").codes(),
            std::vector<std::string>{"E0914"});
  std::string bytes = content(path("o/learn.training"));
  std::ofstream(path("o/learn.training"), std::ios::binary) << bytes.substr(0, bytes.size() - 9);
  EXPECT_EQ(learn(text, "--out o --resume").codes(), std::vector<std::string>{"E0907"});
}

// ---- comparison with plain schemes ----------------------------------------------------------------------------------

const std::string finer = R"(
scene middle : burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.3; a = 1; phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 2, step 1/32
}
dataset unseen_32 : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 2; file "unseen_32.nc" }
dataset unseen_64 : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; file "unseen_64.nc" }
dataset rare : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/8; coarsen 2; file "rare.nc" }
)";
const std::string error = "test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps";

class Beside : public Evaluation {
 protected:
  void SetUp() override {
    Evaluation::SetUp();
    write("data.dpde", burgers + finer);
    for (const std::string set : {"unseen_32", "unseen_64", "rare"})
      ASSERT_EQ(dpde("run data.dpde " + set + " --out . --json").status, 0);
  }
  Outcome beside(const std::string& scenes, const std::string& arguments = "") const {
    return learn(correcting("epochs 2, seed 3", error + " beside " + scenes) + finer, arguments);
  }
};

double between(double x, double x0, double y0, double x1, double y1) {
  return std::exp(std::log(y0) +
                  (std::log(x) - std::log(x0)) / (std::log(x1) - std::log(x0)) * (std::log(y1) - std::log(y0)));
}

TEST_F(Beside, ScenesAreComparedAtEqualErrorAndCost) {
  const Outcome outcome =
      beside("coarse, middle on trajectories(\"unseen_32.nc\"), fine on trajectories(\"unseen_64.nc\")", "--out o");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json test = outcome.json()["test"]["err"], all = test["beside"];
  // The error of the coarse grid, from a test of a task without a network.
  write("p.dpde", burgers +
                      "task nothing : coarse { data r = trajectories(\"unseen.nc\", u); unknown nu from 0.3; minimise "
                      "mean((u - r)^2) over 1 steps; using adam(rate = 1e-300), epochs 1; " +
                      error + " }\n");
  const Json nothing = dpde("optimize p.dpde nothing --json").json()["test"]["err"];
  EXPECT_EQ(all["coarse"]["course"], nothing["start"]["course"]);
  EXPECT_EQ(all["coarse"]["runs"], nothing["start"]["runs"]);
  EXPECT_LT(all["middle"]["mean"].get<double>(), 0.5 * all["coarse"]["mean"].get<double>()) << "second order";
  EXPECT_NEAR(all["fine"]["mean"].get<double>(), 0, 1e-14) << "what made the data";
  EXPECT_EQ(all["fine"]["course"].size(), 32U);
  EXPECT_EQ(all["middle"]["network"], false);
  for (const Json& each : {test, all["coarse"], all["middle"], all["fine"]}) EXPECT_GT(each["cost_s"].get<double>(), 0);
  const double e = test["mean"].get<double>(), e0 = all["coarse"]["mean"].get<double>(),
               e1 = all["middle"]["mean"].get<double>();
  const double c = test["cost_s"].get<double>(), c0 = all["coarse"]["cost_s"].get<double>(),
               c1 = all["middle"]["cost_s"].get<double>();
  ASSERT_GT(c1, c0);
  if (e > e1 && e < e0) {
    EXPECT_EQ(test["equal_error"]["between"], Json::array({"coarse", "middle"}));
    EXPECT_NEAR(test["equal_error"]["cost_s"].get<double>(), between(e, e0, c0, e1, c1), 1e-9 * c1);
    EXPECT_NEAR(test["equal_error"]["ratio"].get<double>(), between(e, e0, c0, e1, c1) / c, 1e-9);
  }
  if (c > c0 && c < c1) {
    EXPECT_NEAR(test["equal_cost"]["error"].get<double>(), between(c, c0, e0, c1, e1), 1e-9 * e0);
  }
  EXPECT_EQ(std::ranges::count(content(path("o/err_beside.csv")), '\n'), 5);
  const std::string table = content(path("o/err.csv"));
  EXPECT_EQ(table.substr(0, table.find('\n')),
            "t,err,err_spread,err_at_start,err_at_start_spread,err_of_coarse,err_of_coarse_spread,err_of_middle,err_of_"
            "middle_spread,err_of_fine,err_of_fine_spread");
}

TEST_F(Beside, TheLearntNetworkOnAnotherGridIsNoPlainScheme) {
  const std::string other =
      "scene again : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; phase = 0; initial "
      "u = a*sin(x)\n  time 0 .. 2, step 1/16; after step: u += corrector(u) }\n";
  const Json test = learn(correcting("epochs 2, seed 3", error + " beside again") + other, "").json()["test"]["err"];
  EXPECT_EQ(test["beside"]["again"]["course"], test["course"]) << "with the weights that were learnt";
  EXPECT_EQ(test["beside"]["again"]["network"], true);
  EXPECT_FALSE(test.contains("equal_error"));
}

TEST_F(Beside, SettingsOfParametersAreForAll) {
  const Json one = beside("coarse", "--set nu=0.2").json()["test"]["err"]["beside"]["coarse"],
             two = beside("coarse").json()["test"]["err"]["beside"]["coarse"];
  EXPECT_NE(one["course"], two["course"]);
  const Outcome cells = beside("middle on trajectories(\"unseen_32.nc\")", "--set advect=upwind");
  EXPECT_EQ(cells.status, 0) << cells.err;
}

TEST_F(Beside, WhatCannotStandThere) {
  const auto refused = [&](const std::string& scenes, const std::string& code, const std::string& part) {
    const Outcome outcome = beside(scenes);
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{code}) << outcome.out;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  };
  refused("corse", "E0318", "did you mean coarse?");
  refused("coarse, coarse", "E0303", "scene coarse");
  refused("hybrid", "E0303", "scene hybrid");
  refused("middle", "E0907", "it is of another grid: u has 16 cells along x, the scene has 32");
  refused("middle on trajectories(\"rare.nc\")", "E0907",
          "its frames are 0.125 apart, those of unseen.nc, which the task's own scene is tested on, 0.0625");
  refused("middle on \"unseen_32.nc\"", "E0703", "write trajectories(\"test.nc\")");
  refused("middle on trajectories(\"none.nc\")", "E0901", "none.nc");
  const Outcome other = learn(correcting("epochs 1", error + " beside heated") +
                                  "model heat { field w; dt(w) = lap(w) }\nscene heated : heat { grid x = 0 .. 2*pi, "
                                  "cells 16, periodic; initial w = 0; time 0 .. 1, step 1/16 }\n",
                              "");
  EXPECT_EQ(other.status, 2) << other.out;
  EXPECT_NE(other.err.find("scene heated, beside a test"), std::string::npos) << other.err;
}

// ---- statistics and growth rates ------------------------------------------------------------------------------------

/// Learned in one update that changes nothing: the tests see the initial values.
std::string untrained(const std::string& unknown, const std::string& steps, const std::string& tests) {
  return "task t : tried { data r = trajectories(\"truth.nc\", u); " + unknown + "; minimise mean((u - r)^2) over " +
         steps + " steps; using adam(rate = 1e-300), epochs 1; " + tests + " }\n";
}

class Statistics : public Command {
 protected:
  Json found(const std::string& text, const std::string& arguments = "") const {
    write("t.dpde", text);
    const Outcome made = dpde("run t.dpde truths --out . --json");
    EXPECT_EQ(made.status, 0) << made.out << made.err;
    const Outcome outcome = dpde("optimize t.dpde t --json " + arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json();
  }
};

const std::string decay = R"(
model decay { field u; param c; param a; dt(u) = -c*u }
scheme plain { time = euler }
scene truth : decay with plain { grid x = 0 .. 1, cells 3, periodic; c = 0.5; a = 1; initial u = a*(1 + x); time 0 .. 2, step 1/8 }
scene tried : decay with plain { grid x = 0 .. 1, cells 3, periodic; c = 0.25; a = 1; initial u = a*(1 + x); time 0 .. 2, step 1/8 }
scene grown : decay with plain { grid x = 0 .. 1, cells 3, periodic; c = -1; a = 1; initial u = a*(1 + x); time 0 .. 2, step 1/16 }
dataset truths : truth { runs 2; vary a from 1; frames every 1/4; file "truth.nc" }
)";

/// Of first*factor^k, k = 2, 4, ... 16.
std::pair<double, double> mean_and_deviation(double first, double factor) {
  double mean = 0, squares = 0;
  for (int k = 2; k <= 16; k += 2) mean += first * std::pow(factor, k) / 8;
  for (int k = 2; k <= 16; k += 2) squares += std::pow(first * std::pow(factor, k) - mean, 2) / 7;
  return {mean, std::sqrt(squares)};
}

TEST_F(Statistics, AreMeansAndDeviationsOverTime) {
  const Json json =
      found(decay + untrained("unknown c from 0.25", "2",
                              "statistic level = mean(u) on trajectories(\"truth.nc\") for 16 steps beside grown"),
            "--out o");
  const Json level = json["statistic"]["level"];
  const double mean_start = 1.5 * 1.5;  // u = a*(1 + x), a = 1, 2: mean over the cells 1.5 and 3
  const auto check = [&](const Json& one, double factor) {
    const auto [mean, deviation] = mean_and_deviation(mean_start, factor);
    EXPECT_NEAR(one["mean"].get<double>(), mean, 1e-13 * mean);
    EXPECT_NEAR(one["deviation"].get<double>(), deviation, 1e-12 * deviation);
  };
  check(level, 1 - 0.25 / 8);
  check(level["start"], 1 - 0.25 / 8);
  check(level["data"], 1 - 0.5 / 8);
  check(level["beside"]["grown"], std::pow(1 + 1.0 / 16, 2));
  check(level["beside"]["grown"]["data"], 1 - 0.5 / 8);
  EXPECT_NEAR(level["mean_difference"].get<double>(),
              level["mean"].get<double>() / level["data"]["mean"].get<double>() - 1, 1e-14);
  EXPECT_NEAR(level["deviation_difference"].get<double>(),
              level["deviation"].get<double>() / level["data"]["deviation"].get<double>() - 1, 1e-14);
  EXPECT_TRUE(json["test"].empty());
  EXPECT_NE(content(path("o/level.csv")).find("level_of_data,level_of_data_spread,level_of_grown"), std::string::npos);
}

TEST_F(Statistics, NeedTheFieldInTheData) {
  const std::string two = R"(
model two { field u; field v; param c; dt(u) = -c*u; dt(v) = u }
scene truth : two { grid x = 0 .. 1, cells 3, periodic; c = 0.5; initial u = 1; initial v = 0; time 0 .. 1, step 1/8 }
dataset truths : truth { file "truth.nc" }
)";
  write("t.dpde", two);
  ASSERT_EQ(dpde("run t.dpde truths --out . --json").status, 0);
  shell("mv truth.nc all.nc");
  write("u.dpde",
        "model one { field u; param c; dt(u) = -c*u }\nscene truth : one { grid x = 0 .. 1, cells 3, periodic; c = "
        "0.5; initial u = 1; time 0 .. 1, step 1/8 }\ndataset truths : truth { file \"truth.nc\" }\n");
  ASSERT_EQ(dpde("run u.dpde truths --out . --json").status, 0);
  write("v.dpde",
        two +
            "scene tried : two { grid x = 0 .. 1, cells 3, periodic; c = 0.5; initial u = 1; initial v = 0; time 0 .. "
            "1, step 1/8 }\n" +
            untrained("unknown c from 0.25", "2", "statistic s = mean(v) on trajectories(\"truth.nc\") for 8 steps"));
  const Outcome outcome = dpde("optimize v.dpde t --json");
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0907"}) << outcome.out;
  EXPECT_NE(outcome.err.find("it has no v, of which statistic s is to be compared"), std::string::npos) << outcome.err;
}

TEST_F(Statistics, GrowthIsThatOfTheStep) {
  const Json rate =
      found(decay + untrained("unknown c from 0.25", "2",
                              "growth rate on trajectories(\"truth.nc\") for 16 steps beside grown"))["growth"]["rate"];
  EXPECT_NEAR(rate["mean"].get<double>(), 8 * std::log(1 - 0.25 / 8), 1e-13);
  EXPECT_NEAR(rate["spread"].get<double>(), 0, 1e-13);
  EXPECT_NEAR(rate["start"]["mean"].get<double>(), 8 * std::log(1 - 0.25 / 8), 1e-13);
  EXPECT_NEAR(rate["beside"]["grown"]["mean"].get<double>(), 16 * std::log(1 + 1.0 / 16), 1e-13) << "an unstable plant";
}

TEST_F(Statistics, GrowthFindsTheSlowestModeBetweenWalls) {
  const std::string text = R"(
model heat { field u; param nu; dt(u) = nu*lap(u) }
scheme plain { time = euler }
scene truth : heat with plain { grid x = 0 .. 1, cells 5; nu = 0.1; boundary u = 0; initial u = x*(1 - x); time 0 .. 4, step 1/16 }
scene tried : heat with plain { grid x = 0 .. 1, cells 5; nu = 0.1; boundary u = 0; initial u = x*(1 - x); time 0 .. 4, step 1/16 }
dataset truths : truth { frames every 1; file "truth.nc" }
)";
  const Json rate = found(text + untrained("unknown nu from 0.1", "16",
                                           "growth rate on trajectories(\"truth.nc\") for 64 steps"))["growth"]["rate"];
  const double eigenvalue =
      -0.1 * 4 * 25 * std::pow(std::sin(M_PI / 10), 2);  // sin(pi*x) at the centres, ghost cells of the opposite sign
  EXPECT_NEAR(rate["mean"].get<double>(), 16 * std::log(1 + eigenvalue / 16), 2e-3);
}

TEST_F(Statistics, GrowthHoldsTheNetwork) {
  const std::string text = decay +
                           "network gain(u) { initial xavier, seed 4; conv out, 1, bias = 0, gain = 0.3 }\n"
                           "scene steered : decay with plain { grid x = 0 .. 1, cells 3, periodic; c = 0.25; a = 1; "
                           "initial u = a*(1 + x); time 0 .. 2, step 1/8; after step: u += gain(u) }\n"
                           "task t : steered { data r = trajectories(\"truth.nc\", u); learn gain; minimise mean((u - "
                           "r)^2) over 2 steps; using adam(rate = 0.01), epochs 3\n"
                           "  growth rate on trajectories(\"truth.nc\") for 16 steps beside tried }\n";
  const Json json = found(text), rate = json["growth"]["rate"];
  const double weight = json["unknowns"]["gain"]["norm"].get<double>(), own = 8 * std::log(1 - 0.25 / 8);
  const double added = rate["mean"].get<double>() - own, up = 8 * std::log(1 + weight), down = 8 * std::log(1 - weight);
  ASSERT_GT(weight, 1e-3);
  EXPECT_LT(std::min(std::abs(added - up), std::abs(added - down)), 1e-5) << added << " " << up << " " << down;
  EXPECT_NE(rate["mean"], rate["start"]["mean"]);
  EXPECT_NEAR(rate["beside"]["tried"]["mean"].get<double>(), own, 1e-13);
}

/// Sprott (2003): 0.9056.
TEST_F(Statistics, GrowthOfTheLorenzSystem) {
  const std::string text = R"(
model lorenz { field u; field v; field w; param sigma; param a; dt(u) = sigma*(v - u); dt(v) = u*(28 - w) - v; dt(w) = u*v - 8/3*w }
scheme plain { time = rk4 }
scene truth : lorenz with plain { grid x = 0 .. 1, cells 1, periodic; sigma = 10; a = 1; initial u = a; initial v = 1; initial w = 20; time 0 .. 200, step 1/64 }
scene tried : lorenz with plain { grid x = 0 .. 1, cells 1, periodic; sigma = 10; a = 1; initial u = a; initial v = 1; initial w = 20; time 0 .. 200, step 1/64 }
dataset truths : truth { runs 4; vary a from 1; frames every 1; file "truth.nc" }
)";
  const Json rate =
      found(text + untrained("unknown sigma from 10", "64",
                             "growth rate on trajectories(\"truth.nc\") for 12800 steps"))["growth"]["rate"];
  EXPECT_NEAR(rate["mean"].get<double>(), 0.9056, 0.05);
  EXPECT_LT(rate["spread"].get<double>(), 0.1);
  EXPECT_EQ(rate["runs"].size(), 4U);
}

// ---- conservation in data sets --------------------------------------------------------------------------------------

/// u grows by 1/4 per unit time everywhere, v is advected, w is 0.
TEST_F(Statistics, DataSetsTellHowIntegralsDrift) {
  write("t.dpde", R"(
model m { field u; field v; field w; param c; param a; dt(u) = c; dt(v) = -dx(v); dt(w) = 0*u }
scheme plain { time = euler }
scene truth : m with plain { grid x = 0 .. 3, cells 12, periodic; grid y = 0 .. 2, cells 4, periodic; c = 1/4; a = 1; initial u = a; initial v = sin(2*pi*x/3); initial w = 0; time 0 .. 1, step 1/16 }
dataset truths : truth { runs 2; vary a from 1; frames every 1/4; coarsen 2; file "truth.nc" }
)");
  const Outcome outcome = dpde("run t.dpde truths --out . --json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json found = outcome.json()["conservation"];
  EXPECT_NEAR(found["u"]["drift"].get<double>(), 6 * 0.25, 1e-13);
  EXPECT_NEAR(found["v"]["drift"].get<double>(), 0, 1e-13);
  EXPECT_EQ(found["w"]["drift"], 0.0);
  EXPECT_EQ(found["w"]["relative_drift"], 0.0);
  NetcdfFile file(path("truth.nc").string());
  EXPECT_EQ(file.dimensions("u_integral"), (std::vector<std::string>{"run", "time"}));
  const std::vector<double> integrals = file.values("u_integral"), drifts = file.values("u_drift"),
                            relative = file.values("u_relative_drift");
  ASSERT_EQ(integrals.size(), 10U);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_NEAR(integrals[i], 6 * (1 + static_cast<double>(i / 5) + 0.0625 * static_cast<double>(i % 5)), 1e-13) << i;
  ASSERT_EQ(drifts.size(), 2U);
  for (std::size_t r = 0; r < 2; ++r)
    EXPECT_NEAR(relative[r], 0.25 / (1 + static_cast<double>(r) + 0.125), 1e-13);  // of the mean over the frames
}

}  // namespace
}  // namespace dpde::testing
