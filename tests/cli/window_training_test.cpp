// SPDX-License-Identifier: Apache-2.0
// Training on all samples in one pass with L-BFGS, controls found for each sample, and time per part of an update.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "dpde/runtime/netcdf.h"

namespace dpde::testing {
namespace {

const std::string window_burgers = R"(
model window_burgers { field u; param nu; param a; param phase; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
network corrector(u) { initial he, seed 1; conv 8, 5; tanh; conv out, 5, gain = 0.01 }
scene truth : window_burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.05; a = 1; phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 1, step 1/32
}
scene coarse : window_burgers with plain {
  grid x = 0 .. 2*pi, cells 8, periodic
  nu = 0.05; a = 1; phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 1, step 1/16
  after step: u += corrector(u)
}
dataset train : truth { runs 4; seed 1; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; file "train.nc" }
dataset few : truth { runs 4; seed 1; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 4; file "few.nc" }
)";

std::string viscosity(const std::string& options, const std::string& unknown = "unknown nu from 0.2 in 0 .. 1") {
  return window_burgers + "task learn : truth { data r = trajectories(\"train.nc\", u); " + unknown +
         "; minimise mean((u - r)^2) over 4 steps; using " + options + " }\n";
}
std::string network(const std::string& options) {
  return window_burgers +
         "task learn : coarse { data r = trajectories(\"few.nc\", u); learn corrector; minimise mean((u - r)^2) over 4 "
         "steps; using " +
         options + " }\n";
}

class AllWindows : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("data.dpde", window_burgers);
    for (const std::string set : {"train", "few"})
      ASSERT_EQ(dpde("run data.dpde " + set + " --out . --json").status, 0);
  }
  Outcome learn(const std::string& text, const std::string& arguments) const {
    write("t.dpde", text);
    return dpde("optimize t.dpde learn --json " + arguments);
  }
  /// A training stopped after the first epochs and resumed equals the uninterrupted one with weights in `whole`.
  void expect_to_go_on(const std::string& text, const Json& whole, int first, const std::string& more = "") const {
    ASSERT_EQ(learn(text, "--out parts --epochs " + std::to_string(first) + more).status, 0);
    const Outcome rest = learn(text, "--out parts --resume" + more);
    ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
    EXPECT_EQ(rest.json()["resumed_iterations"], first);
    EXPECT_EQ(rest.json()["loss"], whole["loss"]);
    EXPECT_EQ(rest.json()["epochs"], whole["epochs"]);
    EXPECT_EQ(content(path("parts/corrector.safetensors")), content(path("whole/corrector.safetensors")));
  }
};

TEST_F(AllWindows, LbfgsFindsTheViscosity) {
  const Outcome found = learn(viscosity("lbfgs(), epochs 20"), "--out o");
  ASSERT_EQ(found.status, 0) << found.out << found.err;
  const Json json = found.json();
  EXPECT_NEAR(json["unknowns"]["nu"]["value"].get<double>(), 0.05, 1e-9) << "the data are of the scene itself";
  EXPECT_EQ(json["windows"], 60);
  for (std::size_t k = 1; k < json["loss"].size(); ++k) EXPECT_LT(json["loss"][k], json["loss"][k - 1]);
  for (std::size_t k = 1; k < json["loss"].size(); ++k)
    EXPECT_EQ(json["loss"][k], json["epochs"][k - 1]["loss"]) << "an epoch's loss is the one behind it";
  const Json at_once = learn(viscosity("adam(rate = 0.01), batch 1000, epochs 1"), "").json();
  EXPECT_NEAR(json["loss"][0].get<double>(), at_once["loss"][0].get<double>(), 1e-12 * at_once["loss"][0].get<double>())
      << "the same windows, in another order";
  const Json bounded = learn(viscosity("lbfgs(), epochs 20", "unknown nu from 0.2 in 0.1 .. 1"), "").json();
  EXPECT_EQ(bounded["unknowns"]["nu"]["value"], 0.1);
}

TEST_F(AllWindows, LbfgsLearnsANetworkTheSameForAnyNumberOfThreads) {
  const std::string text = network("lbfgs(), epochs 25, validate 0.25");
  const Outcome one = learn(text, "--threads 1"), two = learn(text, "--threads 2");
  ASSERT_EQ(one.status, 0) << one.out << one.err;
  EXPECT_EQ(one.json()["loss"], two.json()["loss"]);
  EXPECT_EQ(one.json()["epochs"], two.json()["epochs"]);
  EXPECT_LT(one.json()["loss"].back().get<double>(), 0.2 * one.json()["loss"][0].get<double>());
  const Json adam = learn(network("adam(rate = 3e-3), batch 45, epochs 25, validate 0.25"), "").json();
  EXPECT_LT(one.json()["loss"].back(), adam["loss"].back()) << "as many updates";
}

TEST_F(AllWindows, LbfgsGoesOnToTheSameNumbers) {
  const std::string text = network("lbfgs(), epochs 16, validate 0.25");
  const Outcome whole = learn(text, "--out whole");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  expect_to_go_on(text, whole.json(), 5);
}

/// For a sum of squares with minimum 0 both Hessians agree there: digits double with each iteration.
TEST_F(AllWindows, NewtonsMethodFindsTheViscosity) {
  for (const std::string hessian : {"full", "gauss_newton"}) {
    const Outcome found = learn(viscosity("newton_cg(hessian = " + hessian + "), epochs 12"), "--out o");
    ASSERT_EQ(found.status, 0) << found.out << found.err;
    const Json json = found.json();
    EXPECT_NEAR(json["unknowns"]["nu"]["value"].get<double>(), 0.05, 1e-12) << hessian;
    const std::vector<double> loss = json["loss"].get<std::vector<double>>();
    for (std::size_t k = 1; k < loss.size(); ++k) EXPECT_LT(loss[k], loss[k - 1]) << hessian;
    EXPECT_LT(loss.size(), 10U) << hessian;
  }
  const Json bounded = learn(viscosity("newton_cg(), epochs 20", "unknown nu from 0.2 in 0.1 .. 1"), "").json();
  EXPECT_EQ(bounded["unknowns"]["nu"]["value"], 0.1);
}

/// Weights of a network: with as many updates L-BFGS leaves a larger loss. A resumed training, with its trust region,
/// is bit-identical, for any number of threads.
TEST_F(AllWindows, NewtonsMethodLearnsANetworkAndGoesOn) {
  const std::string text = network("newton_cg(hessian = gauss_newton), epochs 8, validate 0.25");
  const Outcome whole = learn(text, "--out whole --threads 1");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  expect_to_go_on(text, whole.json(), 3, " --threads 2");
  const Json lbfgs = learn(network("lbfgs(), epochs 8, validate 0.25"), "").json();
  EXPECT_LT(whole.json()["loss"].back().get<double>(), lbfgs["loss"].back().get<double>());
  const Outcome other = learn(network("newton_cg(), epochs 8, validate 0.25"), "--out parts --resume");
  EXPECT_EQ(other.codes(), std::vector<std::string>{"E0914"});
}

/// The same problem with unknowns of size 1, and with one of 1e-2 and one of 1e-6.
std::string two_sizes(bool scaled) {
  const std::string rates = scaled ? "param a = 2, b = 1; dt(u) = -a*u - u*v; dt(v) = 1 - b*v"
                                   : "param a = 0.02, b = 1e-6; dt(u) = -100*a*u - u*v; dt(v) = 1 - 1e6*b*v";
  return "model m { field u, v; " + rates + R"( }
scheme r { time = rk4 }
scene s : m with r { grid x = 0 .. 1, cells 3, periodic; initial u = 1 + x; initial v = 0; time 0 .. 2, step 1/16 }
dataset d : s { runs 1; frames every 1/16; file "d.nc" }
task learn : s {
  data du = trajectories("d.nc", u); data dv = trajectories("d.nc", v)
  unknown a from )" +
         (scaled ? "0.5; unknown b from 3" : "0.005; unknown b from 3e-6") + R"(
  minimise mean((u - du)^2) + mean((v - dv)^2) over 8 steps
  using lbfgs(), epochs 25
}
)";
}

TEST_F(AllWindows, LbfgsTakesUnknownsByTheirSizes) {
  std::vector<Json> found;
  for (const bool scaled : {true, false}) {
    write("t.dpde", two_sizes(scaled));
    ASSERT_EQ(dpde("run t.dpde d --out . --json").status, 0);
    found.push_back(dpde("optimize t.dpde learn --json --out o" + std::to_string(scaled)).json());
    if (scaled) continue;
    ASSERT_EQ(dpde("optimize t.dpde learn --epochs 3 --json --out part" + std::to_string(scaled)).status, 0);
    const Json rest = dpde("optimize t.dpde learn --resume --json --out part" + std::to_string(scaled)).json();
    EXPECT_EQ(rest["loss"], found.back()["loss"]) << "the sizes are those of the first start";
  }
  const Json &one = found[0]["loss"], &other = found[1]["loss"];
  for (std::size_t k = 0; k < std::min({one.size(), other.size(), std::size_t{8}}); ++k)
    EXPECT_NEAR(one[k].get<double>(), other[k].get<double>(), 1e-6 * one[0].get<double>()) << k;
  EXPECT_NEAR(found[1]["unknowns"]["a"]["value"].get<double>(), 0.02, 1e-8);
  EXPECT_NEAR(found[1]["unknowns"]["b"]["value"].get<double>(), 1e-6, 1e-12);
}

TEST_F(AllWindows, LbfgsStopsWhenAskedAndGoesOn) {
  write("t.dpde", network("lbfgs(), epochs 100000"));
  const Outcome stopped =
      interrupted("optimize t.dpde learn --out o --checkpoint-every 1 --json", "0.05", "o/learn.training");
  ASSERT_EQ(stopped.codes(), std::vector<std::string>{"E0806"}) << stopped.out << stopped.err;
  const auto made = stopped.json()["iterations"].get<int>();
  const std::string more = " --epochs " + std::to_string(made + 3);
  const Json rest = dpde("optimize t.dpde learn --out o --resume --json" + more).json(),
             whole = dpde("optimize t.dpde learn --json" + more).json();
  EXPECT_EQ(rest["resumed_iterations"], made);
  EXPECT_EQ(rest["loss"], whole["loss"]);
}

TEST_F(AllWindows, WhatLbfgsCannotBeCombinedWith) {
  const auto refused = [&](const std::string& options, const std::string& code, const std::string& part) {
    const Outcome outcome = learn(viscosity(options), "");
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{code}) << options << outcome.out;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << options << "\n" << outcome.err;
  };
  for (const std::string option :
       {"batch 4", "seed 3", "noise 0.1", "clip 1", "cut 1", "schedule cosine", "unroll (2, 4)"}) {
    refused("lbfgs(), epochs 4, " + option, "E0311", "whose iterations see all windows at once");
  }
  refused("newton_cg(), epochs 4, noise 0.1", "E0311", "a task that learns by newton_cg, whose iterations see all");
  refused("adam(rate = 0.1), epochs 2, unroll (1, 2, 4)", "E0707", "has 3 lengths for 2 epochs");
  EXPECT_EQ(learn(viscosity("lbfgs(), epochs 2, unroll 2, patience 3"), "").status, 0);
  for (const auto& [options, more] :
       {std::pair<std::string, std::string>{"adam(rate = 0.1), epochs 3, unroll (1, 2, 4)", "--epochs 2"},
        {"lbfgs(), epochs 2", "--iterations 3"}}) {
    const Outcome outcome = learn(viscosity(options), more);
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0904"});
    EXPECT_NE(outcome.err.find("using " + options), std::string::npos) << "the line is shown: " << outcome.err;
  }
}

TEST_F(AllWindows, AResumeThatIsRefusedSaysWhatDiffers) {
  ASSERT_EQ(learn(viscosity("adam(rate = 0.02), batch 4, epochs 1"), "--out o").status, 0);
  const auto refused = [&](const std::string& options, const std::string& part) {
    const Outcome outcome = learn(viscosity(options), "--out o --resume");
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0914"}) << options;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << options << "\n" << outcome.err;
  };
  refused("adam(rate = 0.03), batch 4, epochs 1", "it was made with another rate");
  refused("adam(rate = 0.03), batch 4, epochs 1", "it has 0.02, the task 0.03");
  refused("adam(rate = 0.02), batch 5, epochs 1", "it has 4, the task 5");
  refused("lbfgs(), epochs 1", "another optimiser");
}

TEST_F(AllWindows, ASeedOfTheCommandIsAddedToThoseOfTheFile) {
  const auto losses = [&](const std::string& seed, const std::string& weights, const std::string& arguments) {
    std::string text = network("adam(rate = 0.01), batch 5, epochs 1, seed " + seed);
    const Outcome outcome = learn(text.replace(text.find("seed 1;"), 7, "seed " + weights + ";"), arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json()["loss"];
  };
  EXPECT_EQ(losses("3", "1", "--seed 4"), losses("7", "5", ""));
  EXPECT_NE(losses("3", "1", "--seed 4"), losses("3", "1", ""));
}

TEST_F(AllWindows, BenchTellsWhereTheTimeOfAnUpdateGoes) {
  write("t.dpde", network("adam(rate = 0.02), batch 5, epochs 1"));
  for (const std::string threads : {"1", "2"}) {
    const Outcome outcome = dpde("bench t.dpde learn --json --repeats 3 --threads " + threads);
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    const Json update = outcome.json()["update"];
    EXPECT_EQ(update["windows"], 5);
    EXPECT_EQ(update["steps"], 4);
    double parts = update["overhead"].get<double>();
    for (const char* part : {"solver_forward", "solver_backward", "networks_forward", "networks_backward"}) {
      EXPECT_GT(update[part], 0) << part;
      parts += update[part].get<double>();
    }
    EXPECT_NEAR(parts, update["thread_seconds"].get<double>(), 1e-9);
    EXPECT_GT(update["overhead"].get<double>(),
              update["losses"].get<double>() + update["waiting"].get<double>() - 1e-9);
    EXPECT_GT(update["losses"], 0);
    EXPECT_GE(update["waiting"].get<double>(), threads == "1" ? 0 : 1e-9);
  }
}

// u decays, which the scene does not model: its corrections are the decay.
const std::string decaying = R"(
model decay { field u; param k; dt(u) = -k*u }
model rest { field u; dt(u) = 0 }
model pairs { field made; dt(made) = 0 }
model answer { field told; param q; dt(told) = 0 }
model correction { control field c }
scheme plain { time = euler }
scene truth : decay with plain { grid x = 0 .. 1, cells 3, periodic; k = 0.5; initial u = 1 + x; time 0 .. 1, step 1/16 }
scene corrected : rest, pairs, correction with plain {
  grid x = 0 .. 1, cells 3, periodic
  c = 0 every 1/16
  initial u = 0
  initial made = 0
  time 0 .. 1, step 1/16
  after step: made = c, u += c
}
scene fit : rest, pairs, answer with plain {
  grid x = 0 .. 1, cells 3, periodic
  q = 0
  initial u = 0; initial made = 0; initial told = 0
  time 0 .. 1, step 1/16
  after step: told = q*(u - made)
}
dataset train : truth { runs 2; vary k from 1; frames every 1/16; file "train.nc" }
task learn : fit { data r = trajectories("o/find.nc", made); unknown q from 0; minimise mean((told - made)^2) over 1 steps; using lbfgs(), epochs 5 }
)";

std::string finding(const std::string& loss, const std::string& steps, const std::string& more = "") {
  return decaying + "task find : corrected { data r = trajectories(\"train.nc\", u); unknown c from 0; " + more +
         "minimise " + loss + " over " + steps + " steps; using lbfgs(), iterations 60 }\n";
}

class WindowControls : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("t.dpde", finding("mean((u - r)^2)", "4"));
    ASSERT_EQ(dpde("run t.dpde train --out . --json").status, 0);
  }
  std::vector<double> read(const std::string& file, const std::string& variable) const {
    const NetcdfReader reader(content(path(file)), file);
    return reader.read(*reader.find(variable));
  }
};

TEST_F(WindowControls, AreWhatTheSceneLacks) {
  const Outcome found = dpde("optimize t.dpde find --out o --json");
  ASSERT_EQ(found.status, 0) << found.out << found.err;
  EXPECT_EQ(found.json()["windows"], 8);
  EXPECT_LT(found.json()["loss"].back().get<double>(), 1e-16);
  const std::vector<double> data = read("train.nc", "u"), u = read("o/find.nc", "u"), made = read("o/find.nc", "made"),
                            t = read("o/find.nc", "time");
  ASSERT_EQ(u.size(), 2U * 16 * 3);
  EXPECT_NEAR(t.front(), 1.0 / 16, 1e-12);
  for (std::size_t run = 0; run < 2; ++run) {
    for (std::size_t i = 0; i < 48; ++i) {
      const double before = data[run * 51 + i], behind = data[run * 51 + i + 3];
      EXPECT_NEAR(u[run * 48 + i], behind, 1e-7);
      EXPECT_NEAR(made[run * 48 + i], behind - before, 1e-7);
    }
  }
  EXPECT_EQ(read("o/find.nc", "u"),
            (dpde("optimize t.dpde find --out one --threads 1 --json"), read("one/find.nc", "u")))
      << "for any number of threads";
}

TEST_F(WindowControls, WeighWhatTheyCost) {
  write("t.dpde", finding("mean((u - r)^2) + 3*mean(made^2)", "1"));
  ASSERT_EQ(dpde("optimize t.dpde find --out o --json").status, 0);
  const std::vector<double> data = read("train.nc", "u"), made = read("o/find.nc", "made");
  ASSERT_EQ(made.size(), 2U * 16 * 3);
  for (std::size_t i = 0; i < 48; ++i)
    EXPECT_NEAR(made[i], (data[i + 3] - data[i]) / 4, 1e-9) << "the least of (c - d)^2 + 3*c^2";
}

TEST_F(WindowControls, AreLearntWithoutTheSolver) {
  ASSERT_EQ(dpde("optimize t.dpde find --out o --json").status, 0);
  const Outcome learnt = dpde("optimize t.dpde learn --json");
  ASSERT_EQ(learnt.status, 0) << learnt.out << learnt.err;
  // Two runs, k = 1 and 2: the least-squares fit of one rate to both.
  const std::vector<double> data = read("train.nc", "u");
  double products = 0, squares = 0;
  for (std::size_t run = 0; run < 2; ++run) {
    for (std::size_t i = 0; i < 48; ++i) {
      const double before = data[run * 51 + i];
      products += before * (data[run * 51 + i + 3] - before);
      squares += before * before;
    }
  }
  EXPECT_NEAR(learnt.json()["unknowns"]["q"]["value"].get<double>(), products / squares, 1e-5);
}

TEST_F(WindowControls, WhatSuchATaskCannotSay) {
  const auto refused = [&](const std::string& text, const std::string& arguments, const std::string& code,
                           const std::string& part) {
    write("w.dpde", text);
    const Outcome outcome = dpde("optimize w.dpde find --json " + arguments);
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{code}) << part << outcome.out;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << part << "\n" << outcome.err;
  };
  const std::string good = finding("mean((u - r)^2)", "4");
  const auto with = [&](const std::string& options) {
    std::string text = good;
    return text.replace(text.rfind("lbfgs(), iterations 60"), 22, options);
  };
  refused(with("lbfgs(), epochs 5"), "--out o", "E0311", "understood here: iterations, of each window");
  refused(with("adam(rate = 0.1, decay = 0.1), iterations 5"), "--out o", "E0311", "momentum or decay");
  refused(finding("mean((u - r)^2)", "4", "test e = mean(u^2) on trajectories(\"train.nc\") for 4 steps; "), "--out o",
          "E0311", "a test");
  refused(good, "", "E0904", "needs --out DIR");
  refused(good, "--out o --epochs 3", "E0904", "--epochs is not for task find");
  refused(good, "--out o --epochs 3", "E0904", "using lbfgs(), iterations 60");
}

/// A search that takes some time.
std::string slow() {
  std::string text = finding("mean((u - r)^2)", "4");
  return text.replace(text.rfind("lbfgs(), iterations 60"), 22, "adam(rate = 1e-3), iterations 60000");
}

TEST_F(WindowControls, GoOnAfterCtrlCOrAKill) {
  write("slow.dpde", slow());
  ASSERT_EQ(dpde("optimize slow.dpde find --out whole --threads 1 --json").status, 0);
  const Outcome stopped = interrupted("optimize slow.dpde find --out o --threads 1 --json", "0", "o/find.nc.0.0");
  ASSERT_EQ(stopped.codes(), std::vector<std::string>{"E0806"})
      << "too short to be interrupted" << stopped.out << stopped.err;
  EXPECT_NE(stopped.err.find("--resume searches the others"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(path("o/find.nc")));
  shell(
      "$DPDE optimize slow.dpde find --resume --out o --threads 1 --json & run=$!; for i in $(seq 6000); do [ $(ls o | "
      "wc -l) -ge 3 ] && break; sleep 0.01; done; kill -9 $run; wait $run");
  ASSERT_FALSE(fs::exists(path("o/find.nc"))) << "too short to be killed";
  fs::resize_file(path("o/find.nc.0.4"), 100);
  const Outcome rest = dpde("optimize slow.dpde find --resume --out o --threads 2 --json");
  ASSERT_EQ(rest.status, 0) << rest.err;
  EXPECT_GE(rest.json()["resumed_windows"], 1);
  EXPECT_LT(rest.json()["resumed_windows"], 8) << "a damaged one is sought again";
  for (const char* variable : {"u", "made", "time"})
    EXPECT_EQ(read("o/find.nc", variable), read("whole/find.nc", variable)) << variable;
  for (const auto& file : fs::directory_iterator(path("o"))) {
    if (file.path().filename() != ".dpde") EXPECT_EQ(file.path().filename(), "find.nc");
  }
  const Outcome over = dpde("optimize slow.dpde find --resume --out o --json"),
                words = dpde("optimize slow.dpde find --resume --out o");
  ASSERT_EQ(over.status, 0) << over.err;
  EXPECT_EQ(over.json()["resumed_windows"], rest.json()["windows"]);
  EXPECT_FALSE(over.json().contains("wall_s")) << "nothing was searched";
  for (const char* key : {"loss", "windows", "unknowns", "left_out", "iterations"})
    EXPECT_EQ(over.json()[key], rest.json()[key]) << key;
  EXPECT_NE(words.out.find("find: all windows are searched already, find.nc is there\n"), std::string::npos)
      << words.out;
  EXPECT_NE(words.out.find("mean loss"), std::string::npos) << words.out;
}

TEST_F(WindowControls, OfAnotherSearchAreSoughtAgain) {
  write("slow.dpde", slow());
  ASSERT_EQ(interrupted("optimize slow.dpde find --out o --threads 1 --json", "0", "o/find.nc.0.0").status, by_ctrl_c);
  const Outcome other = dpde("optimize slow.dpde find --resume --iterations 3 --out o --json");
  ASSERT_EQ(other.status, 0) << other.err;
  EXPECT_EQ(other.json()["resumed_windows"], 0);
}

/// Runs with k above 1.5 blow up in their second step.
std::string bursting(const std::string& first) {
  std::string text = finding("mean((u - r)^2)", "5");
  const auto replace = [&](const std::string& what, const std::string& with) {
    text.replace(text.find(what), what.size(), with);
  };
  replace("model rest { field u; dt(u) = 0 }", "model rest { field u; param k; dt(u) = if(k > 1.5, 1e300*u^2, 0) }");
  replace("  c = 0 every 1/16\n", "  c = 0 every 1/16\n  k = 0\n");
  replace("  q = 0\n", "  q = 0\n  k = 0\n");
  replace("vary k from 1", "vary k from " + first);
  return text;
}

TEST_F(WindowControls, ThatBlowUpDoNotEndTheSearch) {
  write("b.dpde", bursting("1"));
  const Outcome found = dpde("optimize b.dpde find --out o --json");
  ASSERT_EQ(found.status, 0) << found.out << found.err;
  const Json json = found.json();
  ASSERT_EQ(json["left_out"].size(), 3U) << json;
  EXPECT_EQ(json["left_out"][1]["run"], 1);
  EXPECT_EQ(json["left_out"][1]["frame"], 5);
  EXPECT_NE(json["left_out"][1]["why"].get<std::string>().find("u has grown from "), std::string::npos) << json;
  EXPECT_NE(found.err.find("the window from frame 5 of run 1"), std::string::npos) << found.err;
  EXPECT_NE(found.err.find("bounds of the controls"), std::string::npos) << found.err;
  EXPECT_EQ(json["windows"], 3);
  EXPECT_EQ(json["frames_left_over"], 1) << "17 frames, three windows of 5 steps behind the first";
  EXPECT_EQ(read("o/find.nc", "k"), std::vector<double>{1});
  const std::vector<double> data = read("train.nc", "u"), u = read("o/find.nc", "u");
  ASSERT_EQ(u.size(), 15U * 3);
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(u[i], data[i + 3], 1e-7);
}

TEST_F(WindowControls, ThatAllBlowUpAreAnError) {
  write("b.dpde", bursting("2"));
  ASSERT_EQ(dpde("run b.dpde train --out . --json").status, 0);
  const Outcome none = dpde("optimize b.dpde find --out o --json");
  EXPECT_EQ(none.status, 1);
  EXPECT_EQ(none.codes(), std::vector<std::string>{"E0807"}) << none.err;
  EXPECT_FALSE(fs::exists(path("o/find.nc")));
}

}  // namespace
}  // namespace dpde::testing
