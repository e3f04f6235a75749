// SPDX-License-Identifier: Apache-2.0
// What a training has to show for itself: several trials, plain schemes beside it, statistics, rates of growth.
#include "command_support.h"

#include <algorithm>
#include <cmath>

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

std::string network(int seed) { return "network corrector(u) { initial he, seed " + std::to_string(seed) + "; conv 4, 5; tanh; conv out, 5, gain = 0.01 }\n"; }

/// A correction of the coarse grid, with `options` of the training and `tests`.
std::string correcting(const std::string& options, const std::string& tests = "test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps", int network_seed = 5) {
  return burgers + network(network_seed) +
         "scene hybrid : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; phase = 0; initial u = a*sin(x) + 0.3*cos(2*x + phase)\n"
         "  time 0 .. 2, step 1/16; after step: u += corrector(u) }\n"
         "task learn : hybrid { data r = trajectories(\"train.nc\", u); learn corrector; minimise mean((u - r)^2) over 4 steps\n"
         "  using adam(rate = 3e-3), batch 8, " + options + "\n  " + tests + " }\n";
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
    return dpde("optimize t.dpde learn --json " + arguments);
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
    const Json alone = learn(correcting("seed " + std::to_string(3 + more) + rest, "test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps", 5 + more), "--out o" + std::to_string(k)).json();
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
  EXPECT_EQ(content(path("o/corrector.safetensors")), content(path("o" + std::to_string(best) + "/corrector.safetensors")));
  EXPECT_NE(content(path("o/corrector.safetensors")), content(path("o" + std::to_string((best + 1) % 3) + "/corrector.safetensors")));
  const Json over = all["test"]["err"]["trials"];
  EXPECT_NEAR(over["mean"].get<double>(), sum / 3, 1e-12);
  double squares = 0;
  for (const Json& each : over["each"]) squares += std::pow(each["mean"].get<double>() - sum / 3, 2);
  EXPECT_NEAR(over["spread"].get<double>(), std::sqrt(squares / 2), 1e-12);
  const std::string table = content(path("o/err.csv"));
  EXPECT_EQ(table.substr(0, table.find('\n')), "t,err,err_spread,err_at_start,err_at_start_spread,err_of_trial_1,err_of_trial_2,err_of_trial_3,err_of_trials,err_of_trials_spread");
  EXPECT_EQ(std::ranges::count(content(path("o/loss.csv")), '\n'), 1 + 3 * static_cast<std::ptrdiff_t>(all["loss"].size()));
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
  EXPECT_NEAR(from_file["trials"][0]["loss"][0].get<double>(), from_file["trials"][1]["loss"][0].get<double>(), 1e-13) << "one batch of all windows, in another order";
}

TEST_F(Evaluation, TrialsGoOnToTheSameNumbers) {
  const std::string text = correcting("seed 3, epochs 6, trials 3, noise 0.01, schedule halve(20)");
  const Outcome whole = learn(text, "--out whole");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  // Ended within the second trial, by force.
  shell("$DPDE optimize t.dpde learn --out o --checkpoint-every 2 --json & run=$!; for i in $(seq 6000); do grep -q dpdetrls o/learn.training && break; sleep 0.002; done; kill -9 $run; wait $run");
  ASSERT_NE(content(path("o/learn.training")).find("dpdetrls"), std::string::npos);
  const Outcome rest = dpde("optimize t.dpde learn --out o --resume --json");
  ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
  EXPECT_GT(rest.json()["resumed_iterations"], whole.json()["iterations"]) << "the first trial was over";
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(rest.json()["trials"][k]["loss"], whole.json()["trials"][k]["loss"]) << k;
    EXPECT_EQ(rest.json()["trials"][k]["best"], whole.json()["trials"][k]["best"]) << k;
  }
  EXPECT_EQ(rest.json()["test"], whole.json()["test"]);
  EXPECT_EQ(content(path("o/corrector.safetensors")), content(path("whole/corrector.safetensors")));
  // More epochs and more trials are wanted later.
  ASSERT_EQ(learn(correcting("seed 3, epochs 3, trials 2, noise 0.01, schedule halve(20)"), "--out more").status, 0);
  const Outcome more = learn(text, "--out more --resume");
  ASSERT_EQ(more.status, 0) << more.out << more.err;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(more.json()["trials"][k]["loss"], whole.json()["trials"][k]["loss"]) << k;
  // Another seed is another training.
  EXPECT_EQ(learn(correcting("seed 4, epochs 6, trials 3, noise 0.01, schedule halve(20)"), "--out o --resume").codes(), std::vector<std::string>{"E0914"});
  std::string bytes = content(path("o/learn.training"));
  std::ofstream(path("o/learn.training"), std::ios::binary) << bytes.substr(0, bytes.size() - 9);
  EXPECT_EQ(learn(text, "--out o --resume").codes(), std::vector<std::string>{"E0907"});
}

TEST_F(Evaluation, WhatTrialsCannotBe) {
  write("t.dpde", correcting("trials 0"));
  const Outcome none = dpde("check t.dpde learn");
  EXPECT_NE(none.err.find("error[E0707]: trials of using is a whole number from 1 on, not 0"), std::string::npos) << none.err;
  write("p.dpde", burgers + "task find : coarse { data r = u from scene fine; unknown nu from 0.2; minimise mean((u - r)^2); using lbfgs(), trials 3 }\n");
  const Outcome other = dpde("check p.dpde find");
  EXPECT_NE(other.err.find("trials cannot appear in a task that does not learn from trajectories"), std::string::npos) << other.err;
}

}  // namespace
}  // namespace dpde::testing
