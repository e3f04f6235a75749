// SPDX-License-Identifier: Apache-2.0
// Data sets and training on them, as for users: runs with varied parameters in one file, a parameter learned from
// mini-batches of samples, killed and resumed.
#include <algorithm>
#include <cmath>

#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string burgers_on_32_cells = R"(
model burgers { field u; param nu; param a; param phase; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene truth : burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.05
  a = 1
  phase = 0
  initial u = a*sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 1, step 1/32
}
dataset train : truth { runs 4; seed 1; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; file "train.nc" }
dataset other : truth { runs 3; seed 9; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; file "test.nc" }
)";

std::string learning(const std::string& options, const std::string& data = "train.nc", const std::string& steps = "4") {
  return burgers_on_32_cells + "task learn : truth { data u_ref = trajectories(\"" + data +
         "\", u); unknown nu from 0.2 in 0 .. 1; minimise mean((u - u_ref)^2) over " + steps + " steps; using " +
         options + "; test err = mean(abs(u - u_ref)) on trajectories(\"test.nc\") for 32 steps }\n";
}

const std::string adam = "adam(rate = 0.02), batch 4, epochs 20, schedule cosine, validate 0.25, seed 3";

class Training : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("data.dpde", burgers_on_32_cells);
    for (const std::string set : {"train", "other"}) {
      const Outcome made = dpde("run data.dpde " + set + " --out . --json");
      ASSERT_EQ(made.status, 0) << made.out << made.err;
    }
  }
  Outcome learn(const std::string& options, const std::string& arguments, const std::string& steps = "4") const {
    write("t.dpde", learning(options, "train.nc", steps));
    return dpde("optimize t.dpde learn " + arguments);
  }
};

TEST_F(Training, FindsTheViscosityOfFourRuns) {
  const Outcome outcome = learn(adam, "--out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json json = outcome.json();
  EXPECT_NEAR(json["unknowns"]["nu"]["value"].get<double>(), 0.05, 1e-4);
  EXPECT_EQ(json["unknowns"]["nu"]["start"], 0.2);
  EXPECT_EQ(json["windows"], 45);  // three runs of 17 frames, samples with two further frames
  EXPECT_EQ(json["iterations"], 20 * 12);
  EXPECT_EQ(json["loss"].size(), 240U);
  EXPECT_EQ(json["epochs"].size(), 20U);
  const Json test = json["test"]["err"];
  EXPECT_EQ(test["runs"].size(), 3U);
  EXPECT_EQ(test["t"].size(), 16U);
  EXPECT_LT(test["mean"].get<double>(), 1e-2 * test["start"]["mean"].get<double>());
  for (const char* file : {"loss.csv", "epochs.csv", "err.csv", "learn.training"})
    EXPECT_TRUE(fs::exists(path("o") / file)) << file;
}

TEST_F(Training, IsTheSameForAnyNumberOfThreads) {
  const Outcome one = learn(adam, "--threads 1 --epochs 3 --json"), two = learn(adam, "--threads 2 --epochs 3 --json"),
                four = learn(adam, "--threads 4 --epochs 3 --json");
  ASSERT_EQ(one.status, 0) << one.out << one.err;
  for (const Outcome& other : {two, four}) {
    EXPECT_EQ(one.json()["loss"], other.json()["loss"]);
    EXPECT_EQ(one.json()["unknowns"], other.json()["unknowns"]);
    EXPECT_EQ(one.json()["test"], other.json()["test"]);
  }
}

TEST_F(Training, GoesOnToTheSameNumbers) {
  const std::string options =
      "adam(rate = 0.01, decay = 1e-3), batch 3, epochs 8, noise 0.01, clip 1, schedule halve(50), seed 5";
  const Outcome whole = learn(options, "--out whole --json");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  const Outcome first = learn(options, "--out parts --epochs 3 --json");
  ASSERT_EQ(first.status, 0) << first.out << first.err;
  const Outcome rest = learn(options, "--out parts --resume --json");
  ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
  EXPECT_EQ(rest.json()["resumed_iterations"], first.json()["iterations"]);
  EXPECT_EQ(rest.json()["loss"], whole.json()["loss"]);
  EXPECT_EQ(rest.json()["unknowns"], whole.json()["unknowns"]);
}

TEST_F(Training, SurvivesAKill) {
  const std::string options = "adam(rate = 0.01), batch 2, epochs 40, seed 5";
  const Outcome whole = learn(options, "--json");
  ASSERT_EQ(whole.status, 0) << whole.out << whole.err;
  shell(
      "$DPDE optimize t.dpde learn --out o --checkpoint-every 7 --json & run=$!; "
      "for i in $(seq 6000); do [ -s o/learn.training ] && break; sleep 0.01; done; kill -9 $run; wait $run");
  ASSERT_TRUE(fs::exists(path("o/learn.training")));
  const Outcome rest = dpde("optimize t.dpde learn --out o --resume --json");
  ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
  EXPECT_GT(rest.json()["resumed_iterations"], 0);
  EXPECT_EQ(rest.json()["loss"], whole.json()["loss"]);
  EXPECT_EQ(rest.json()["unknowns"], whole.json()["unknowns"]);
}

TEST_F(Training, RefusesToGoOnWithAnother) {
  ASSERT_EQ(learn(adam, "--out o --epochs 2 --json").status, 0);
  EXPECT_EQ(learn("adam(rate = 0.03), batch 4, epochs 2", "--out o --resume --json").codes(),
            std::vector<std::string>{"E0914"});
  std::string bytes = content(path("o/learn.training"));
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(path("o/learn.training"), std::ios::binary) << bytes;
  EXPECT_EQ(learn(adam, "--out o --resume --epochs 2 --json").codes(), std::vector<std::string>{"E0907"});
}

TEST_F(Training, StopsWhenAskedAndGoesOn) {
  write("t.dpde", learning("adam(rate = 0.01), batch 2, epochs 100000"));
  const Outcome stopped =
      interrupted("optimize t.dpde learn --out o --checkpoint-every 5 --json", "0.05", "o/learn.training");
  EXPECT_EQ(stopped.codes(), std::vector<std::string>{"E0806"}) << stopped.out << stopped.err;
  ASSERT_TRUE(fs::exists(path("o/learn.training")));
  const auto made = stopped.json()["iterations"].get<int>();
  const Outcome rest = dpde("optimize t.dpde learn --out o --resume --json --epochs " + std::to_string(made / 30 + 1));
  ASSERT_EQ(rest.status, 0) << rest.out << rest.err;
  EXPECT_EQ(rest.json()["resumed_iterations"], made);
}

TEST_F(Training, CurriculumAndCut) {
  const Outcome grown = learn("adam(rate = 0.02), batch 4, epochs 9, unroll (2, 4, 8), schedule cosine", "--json", "8");
  ASSERT_EQ(grown.status, 0) << grown.out << grown.err;
  const Json epochs = grown.json()["epochs"];
  for (int e = 0; e < 9; ++e) EXPECT_EQ(epochs[static_cast<std::size_t>(e)]["unroll"], e < 3 ? 2 : e < 6 ? 4 : 8);
  EXPECT_NEAR(grown.json()["unknowns"]["nu"]["value"].get<double>(), 0.05, 5e-3);
  const Outcome cut = learn("adam(rate = 0.02), batch 4, epochs 9, cut 2, schedule cosine", "--json", "8");
  const Outcome through = learn("adam(rate = 0.02), batch 4, epochs 9, schedule cosine", "--json", "8");
  ASSERT_EQ(cut.status, 0) << cut.out << cut.err;
  EXPECT_EQ(cut.json()["loss"][0], through.json()["loss"][0]) << "the first loss is the same";
  EXPECT_NE(cut.json()["loss"][5], through.json()["loss"][5]) << "its gradient is not";
  EXPECT_NEAR(cut.json()["unknowns"]["nu"]["value"].get<double>(), 0.05, 5e-3);
}

TEST_F(Training, EarlyStopKeepsTheBest) {
  // A rate so large that the value jumps: the last one is not the best.
  const Outcome outcome =
      learn("gradient_descent(rate = 3, momentum = 0.9), batch 4, epochs 60, validate 0.25, patience 4", "--json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json json = outcome.json();
  double least = INFINITY;
  std::size_t best = 0;
  for (std::size_t e = 0; e < json["epochs"].size(); ++e) {
    const double loss = json["epochs"][e]["validation"].get<double>();
    if (loss < least) best = e;
    least = std::min(least, loss);
  }
  EXPECT_EQ(json["best"]["epoch"], best + 1);
  EXPECT_EQ(json["best"]["loss"], least);
  if (json["reason"] != "all epochs made") {
    EXPECT_EQ(json["epochs"].size(), best + 1 + 4);
  }
}

TEST_F(Training, DivergenceIsNamedAndTheBestKept) {
  write("t.dpde", burgers_on_32_cells +
                      "task learn : truth { data u_ref = trajectories(\"train.nc\", u); unknown nu from 0.2; minimise "
                      "mean((u - u_ref)^2) over 16 steps; "
                      "using gradient_descent(rate = 1e6), batch 4, epochs 5 }\n");
  const Outcome outcome = dpde("optimize t.dpde learn --json");
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0803"}) << outcome.out;
  EXPECT_NE(outcome.err.find("in epoch 1, from frame"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("clip 1"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.json()["unknowns"]["nu"]["value"], 0.2);
}

/// States and losses are finite, and another rate does not help.
TEST_F(Training, ALostSignIsNoDivergence) {
  write("t.dpde", R"(scene s : decay { grid x = -1 .. 1, cells 8, periodic; initial u = a*sin(pi*x)
time 0 .. 1, step 1/20 } model decay { field u; param a; dt(u) = -a*u } model m { field u; param a; dt(u) = -a*atan(1/u)
} scene r : m { grid x = -1 .. 1, cells 8, periodic; initial u = 1; time 0 .. 1, step 1/20 }
dataset seen : s { runs 1; vary a in 0.1 .. 0.2; frames every 1/20; file "s.nc" } task learn : r { unknown a from 0.3
data seen = trajectories("s.nc", u); minimise mean((u - seen)^2) over 4 steps; using adam(rate = 1e-2), batch 2 })");
  ASSERT_EQ(dpde("run t.dpde seen --out . --json").status, 0);
  const Outcome outcome = dpde("optimize t.dpde learn --json");
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0609"}) << outcome.out;
  const std::size_t place = outcome.err.find("in epoch 1, from frame");
  EXPECT_LT(place, outcome.err.find("this divides by u, which changes its sign: a gradient")) << outcome.err;
}

TEST_F(Training, DataThatDoNotFit) {
  const auto refused = [&](const std::string& text, const std::string& arguments = "") {
    write("t.dpde", text);
    const Outcome outcome = dpde("optimize t.dpde learn --json " + arguments);
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0907"}) << outcome.out;
    return outcome.err;
  };
  EXPECT_NE(
      refused(learning(adam), "--set cells=16").find("it is of another grid: u has 32 cells along x, the scene has 16"),
      std::string::npos);
  EXPECT_NE(refused(learning(adam), "--set step=1/24")
                .find("its frames are 0.0625 apart, no whole number of steps of 0.0416667"),
            std::string::npos);
  EXPECT_NE(refused(learning(adam, "train.nc", "3"))
                .find("its frames are 2 steps apart, and 3 steps of the loss are no multiple"),
            std::string::npos);
  EXPECT_NE(refused(learning(adam, "train.nc", "34")).find("too few for windows of 34 steps"), std::string::npos);
  write("one.dpde", burgers_on_32_cells + "dataset one : truth { frames every 1/16; file \"one.nc\" }\n");
  ASSERT_EQ(dpde("run one.dpde one --out . --json").status, 0);
  EXPECT_NE(refused(learning("adam(rate = 0.02), validate 0.05", "one.nc", "8"))
                .find("its last 1 frames, kept for validation, are shorter than a window of 8 steps"),
            std::string::npos);
  write("broken.nc", content(path("train.nc")).substr(0, 3000));
  refused(learning(adam, "broken.nc"));
}

const std::string corrected_burgers = R"(
model burgers { field u; param nu; param a; param phase; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
network corrector(u) { initial he, seed 1; conv 8, 5; tanh; conv out, 5, gain = 0.01 }
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
  after step: u += corrector(u)
}
dataset train : fine { runs 6; seed 1; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 4; file "fine.nc" }
dataset test : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; vary phase in 0 .. 6; frames every 1/16; coarsen 4; file "fine_test.nc" }
)";

std::string correcting(const std::string& from, int epochs) {
  return corrected_burgers + "task learn : coarse { data r = trajectories(\"fine.nc\", u); learn corrector" + from +
         "; minimise mean((u - r)^2) over 4 steps; using adam(rate = 3e-3), batch 8, epochs " + std::to_string(epochs) +
         ", unroll (1, 2, 4), schedule cosine, validate 0.2; test err = mean(abs(u - r)) on "
         "trajectories(\"fine_test.nc\") for 32 steps }\n";
}

TEST_F(Training, ANetworkCorrectsACoarseRun) {
  write("n.dpde", correcting("", 15));
  ASSERT_EQ(dpde("run n.dpde train --out . --json").status, 0);
  ASSERT_EQ(dpde("run n.dpde test --out . --json").status, 0);
  const Outcome first = dpde("optimize n.dpde learn --out o --json");
  ASSERT_EQ(first.status, 0) << first.out << first.err;
  const Json test = first.json()["test"]["err"];
  EXPECT_LT(test["mean"].get<double>(), 0.5 * test["start"]["mean"].get<double>());
  const Outcome two = dpde("optimize n.dpde learn --threads 2 --epochs 15 --json");
  EXPECT_EQ(two.json()["loss"], first.json()["loss"]) << "the same for any number of threads";
  write("again.dpde", correcting(" from \"o/corrector.safetensors\"", 3));
  const Json again = dpde("optimize again.dpde learn --out again --json").json();
  EXPECT_NEAR(again["test"]["err"]["start"]["mean"].get<double>(), test["mean"].get<double>(), 1e-5);
  write(
      "other.dpde",
      correcting(" from \"o/corrector.safetensors\"", 3).replace(corrected_burgers.find("conv 8, 5"), 9, "conv 8, 3"));
  EXPECT_EQ(dpde("optimize other.dpde learn --json").codes(), std::vector<std::string>{"E0907"});
}

TEST_F(Training, SeedsThatDifferMakeOtherScenes) {
  const std::string model = "model m { field u; coefficient f; param nu; param s; dt(u) = nu*lap(u) + f }\n";
  const auto text = [&](const std::string& force, const std::string& start, const std::string& own = "1") {
    return model + "scene truth : m { grid x = 0 .. 1, cells 16, periodic; nu = 0.05; s = " + own + "; f = " + force +
           "; initial u = " + start +
           "; time 0 .. 1, step 1/64 }\n"
           "dataset d : truth { runs 2; vary s from 3; frames every 1/8; file \"d.nc\" }\n"
           "task learn : truth { data r = trajectories(\"d.nc\", u); unknown nu from 0.2; minimise mean((u - r)^2) "
           "over 8 steps; using adam(rate = 0.01), epochs 1 }\n";
  };
  write("force.dpde", text("random_field(seed = s, lowest = 1, highest = 3)", "0"));
  write("start.dpde", text("1", "random_field(seed = s, lowest = 1, highest = 3)"));
  ASSERT_EQ(dpde("run force.dpde d --out . --json").status, 0);
  EXPECT_EQ(dpde("optimize force.dpde learn --json").codes(), std::vector<std::string>{"E0907"});
  for (const std::string own : {"3", "4"}) {  // of the first run, of the last: the other one differs
    write("own.dpde", text("random_field(seed = s, lowest = 1, highest = 3)", "0", own));
    EXPECT_EQ(dpde("optimize own.dpde learn --json").codes(), std::vector<std::string>{"E0907"}) << own;
  }
  ASSERT_EQ(dpde("run start.dpde d --out . --json").status, 0);
  EXPECT_EQ(dpde("optimize start.dpde learn --json").status, 0);
  const auto made_of = [&](const std::string& param, const std::string& rate) {
    std::string whole = text("1", "x");
    whole.replace(whole.find("param s;"), 8, "param s; " + param)
        .replace(whole.find("+ f }"), 5, "+ f + " + rate + " }");
    write("made.dpde", whole);
    return dpde("optimize made.dpde learn --json");
  };
  const std::vector<std::string> none, bad{"E0907"};
  EXPECT_EQ(made_of("param L = 2*s;", "0.01*L").codes(), bad);
  EXPECT_EQ(made_of("param D[2] = (s, 2*s);", "0.01*(D[1] + D[2])").codes(), bad);
  EXPECT_EQ(made_of("let L = 2*s;", "0.01*L").codes(), none);
}

TEST_F(Training, WhatADataSetCannotSay) {
  const auto refused = [&](const std::string& items, const std::string& part) {
    write("d.dpde", burgers_on_32_cells + "dataset d : truth { " + items + " }\n");
    const Outcome outcome = dpde("run d.dpde d --out x");
    EXPECT_NE(outcome.status, 0) << items;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << items << "\n" << outcome.err;
    EXPECT_FALSE(fs::exists(path("x/d.nc")));
  };
  refused("runs 0", "runs of dataset d is a whole number from 1 on, not 0");
  refused("runs 1000000", "runs of dataset d is a whole number from 1 to 100000, not 1000000");
  refused("vary nu in 2 .. 1", "has no number from 2 to 1");
  refused("vary mu in 1 .. 2", "mu");
  refused("vary nu in 1 .. 2; vary nu in 1 .. 2", "vary nu is given twice");
  refused("frames every 0.01", "is no whole number of steps");
  refused("coarsen 3", "does not divide the 32 cells along x");
  refused("file \"d.npy\"", "is the name of a .nc file");
  refused("runs 2; vary nu in -20 .. -19", "run 0 of dataset d: u is no longer finite");
}

/// An array file of 16 values.
std::string array_of(double value) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (16,), }";
  header.resize(117, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00\x76\x00", 10);
  bytes += header;
  for (int i = 0; i < 16; ++i) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

const std::string pushed = R"(
model m { field u; coefficient f; param nu; param a; dt(u) = nu*lap(u) + f }
scene truth : m { grid x = 0 .. 1, cells 16, periodic; nu = 0.01; a = 1; f = load("f.npy"); initial u = a*sin(2*pi*x); time 0 .. 1, step 1/64 }
dataset d : truth { runs 60; vary a in 1 .. 2; frames every 1/8; file "d.nc" }
task learn : truth { data r = trajectories("d.nc", u); unknown nu from 0.2; minimise mean((u - r)^2) over 8 steps; using adam(rate = 0.01), batch 60, epochs 4 }
)";

TEST_F(Training, HalfADataSetGoesOnWithTheSameFilesOnly) {
  write("p.dpde", pushed);
  write("f.npy", array_of(1));
  const Outcome stopped = interrupted("run p.dpde d --out half --threads 1 --json", "0", "half/d.nc.0");
  ASSERT_TRUE(fs::exists(path("half/d.nc.0"))) << stopped.out << stopped.err;
  ASSERT_FALSE(fs::exists(path("half/d.nc"))) << "it was over before it was stopped";
  fs::copy(path("half"), path("other"));
  const Json rest = dpde("run p.dpde d --out half --resume --json").json();
  EXPECT_GT(rest["resumed_runs"], 0);
  ASSERT_EQ(dpde("run p.dpde d --out whole --json").status, 0);
  EXPECT_EQ(content(path("half/d.nc")), content(path("whole/d.nc")));
  write("f.npy", array_of(2));
  EXPECT_EQ(dpde("run p.dpde d --out other --resume --json").json()["resumed_runs"], 0) << "made with another force";
}

TEST_F(Training, GoesOnWithTheSameFilesOnly) {
  write("p.dpde", pushed);
  write("f.npy", array_of(1));
  ASSERT_EQ(dpde("run p.dpde d --out . --json").status, 0);
  ASSERT_EQ(dpde("optimize p.dpde learn --out o --epochs 2 --json").status, 0);
  write("f.npy", array_of(2));
  const Outcome other = dpde("optimize p.dpde learn --out o --resume --json");
  EXPECT_EQ(other.codes(), std::vector<std::string>{"E0914"});
  EXPECT_NE(other.err.find("content of its files"), std::string::npos) << other.err;
  write("f.npy", array_of(1));
  EXPECT_GT(dpde("optimize p.dpde learn --out o --resume --json").json()["resumed_iterations"], 0);
}

/// A varied parameter may change times or grid of the scene, but a file has one of each.
TEST_F(Training, RunsOfADataSetHaveOneGridAndTimes) {
  const auto outcome_of = [&](const std::string& vary, const std::string& grid, const std::string& time) {
    write("k.dpde", "model m { field u; param k; param nu; dt(u) = nu*lap(u) }\nscene truth : m { grid x = " + grid +
                        "; k = 1; nu = 0.01; initial u = sin(2*pi*x); time " + time +
                        " }\ndataset d : truth { runs 2; vary " + vary + "; frames every 1/8; file \"d.nc\" }\n");
    return dpde("run k.dpde d --out x");
  };
  const auto refused = [&](const std::string& vary, const std::string& grid, const std::string& time,
                           const std::string& part) {
    const Outcome outcome = outcome_of(vary, grid, time);
    EXPECT_EQ(outcome.status, 1) << vary << outcome.out << outcome.err;
    EXPECT_NE(outcome.err.find("k.dpde:3:9"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("run 1 of dataset d: " + part), std::string::npos) << part << "\n" << outcome.err;
    EXPECT_FALSE(fs::exists(path("x/d.nc")));
  };
  const std::string grid = "0 .. 1, cells 8, periodic", time = "0 .. 1, step 1/16";
  refused("k from 1", grid, "0 .. 1, step 0.0625/k", "its step is 0.03125, that of run 0 is 0.0625");
  refused("k from 1", grid, "0 .. k, step 1/16", "it is from t = 0 to 2, run 0 from 0 to 1");
  refused("k from 8", "0 .. 1, cells k, periodic", time,
          "its x has 9 cells from 0 to 1, that of run 0 has 8 cells from 0 to 1");
  refused("k from 1", "0 .. k, cells 8, periodic", time,
          "its x has 8 cells from 0 to 2, that of run 0 has 8 cells from 0 to 1");
  EXPECT_EQ(outcome_of("k from 1", grid, time).status, 0);
}

TEST_F(Training, GradientAndVerify) {
  write("t.dpde", learning(adam));
  EXPECT_EQ(dpde("verify t.dpde learn --json").status, 0);
  EXPECT_EQ(dpde("gradient t.dpde learn --json").codes(), std::vector<std::string>{"E0908"});
  EXPECT_EQ(dpde("check t.dpde learn --json").status, 0);
}

/// Start values of solves are not declared states: they are not reported, and data need not have them.
TEST_F(Training, GuessesOfSolvesNeedNotBeInTheData) {
  const auto text = [](const std::string& solve) {
    return "model m { field u; param k; param a; solve lap(psi) - psi = u for psi; dt(u) = k*psi }\n"
           "scheme c { time = rk2; solve = " +
           solve +
           "; guess = last }\nscene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n"
           "  grid y = 0 .. 1, cells 16, periodic\n  k = 0.5\n  a = 1\n  initial u = a*(2 + sin(2*pi*(x + y)))\n"
           "  time 0 .. 1, step 0.1\n}\n"
           "dataset d : s { runs 2; seed 1; vary a in 1 .. 2; frames every 0.1; file \"d.nc\" }\n"
           "task t : s { data r = trajectories(\"d.nc\", u); unknown k from 0.2; minimise mean((u - r)^2) over 4 steps;"
           " using adam(rate = 0.05), batch 2, epochs 40 }\n";
  };
  write("cg.dpde", text("cg(1e-10)"));
  const Outcome kept = dpde("run cg.dpde d --out . --json");
  ASSERT_EQ(kept.status, 0) << kept.err;
  EXPECT_TRUE(kept.json()["conservation"].contains("u"));
  EXPECT_FALSE(kept.json()["conservation"].contains("psi_last"));
  fs::remove(path("d.nc"));
  write("direct.dpde", text("direct"));
  ASSERT_EQ(dpde("run direct.dpde d --out . --json").status, 0);
  const Outcome learnt = dpde("optimize cg.dpde t --json");
  ASSERT_EQ(learnt.status, 0) << learnt.err;
  EXPECT_NEAR(learnt.json()["unknowns"]["k"]["value"].get<double>(), 0.5, 0.02);
}

TEST_F(Training, DataSetsAreMadeAgainOnceTheyAreNotThere) {
  const std::string first = content(path("train.nc"));
  EXPECT_EQ(dpde("run data.dpde train --out again --threads 1 --json").status, 0);
  EXPECT_EQ(content(path("again/train.nc")), first) << "the same bytes for any number of threads";
  const Json there = dpde("run data.dpde train --out again --resume --json").json();
  EXPECT_EQ(there["resumed_runs"], there["runs"]) << "it is complete";
  fs::remove(path("again/train.nc"));
  const Json made = dpde("run data.dpde train --out again --resume --json").json();
  EXPECT_EQ(made["resumed_runs"], 0) << "parts of complete sets are gone";
  EXPECT_EQ(made["frames"], 17);
  EXPECT_NEAR(made["estimates"]["u"]["order"].get<double>(), 2, 0.3);
}

TEST_F(Training, DataSetsAreCoarsened) {
  write("c.dpde", burgers_on_32_cells +
                      "dataset coarse : truth { runs 2; vary a in 0.5 .. 1.5; frames every 1/8 from 1/4 to 1/2; "
                      "coarsen 4; file \"coarse.nc\" }\n"
                      "scene small : burgers with plain { grid x = 0 .. 2*pi, cells 8, periodic; nu = 0.05; a = 1; "
                      "phase = 0; initial u = 0; time 0 .. 1, step 1/32 }\n"
                      "task learn : small { data u_ref = trajectories(\"coarse.nc\", u); unknown nu from 0.2; minimise "
                      "mean((u - u_ref)^2) over 4 steps; using adam(rate = 0.01), epochs 2 }\n");
  const Outcome made = dpde("run c.dpde coarse --out . --json");
  ASSERT_EQ(made.status, 0) << made.out << made.err;
  EXPECT_EQ(made.json()["frames"], 3);
  EXPECT_EQ(made.json()["cells"], Json::array({8}));
  const Outcome learnt = dpde("optimize c.dpde learn --json");
  ASSERT_EQ(learnt.status, 0) << learnt.out << learnt.err;
  EXPECT_EQ(learnt.json()["windows"], 4);
  const auto warnings_of = [](const Outcome& outcome) {
    const std::vector<std::string> codes = outcome.codes();
    return std::count(codes.begin(), codes.end(), "W0902");
  };
  EXPECT_EQ(warnings_of(learnt), 0);
  const Outcome other = dpde("optimize c.dpde learn --set phase=1 --json");
  EXPECT_EQ(other.status, 0) << other.out << other.err;
  EXPECT_EQ(warnings_of(other), 1) << "the data were made with another";
  EXPECT_NE(other.err.find("coarse.nc was made with phase = 0, scene small has 1"), std::string::npos) << other.err;
}

}  // namespace
}  // namespace dpde::testing
