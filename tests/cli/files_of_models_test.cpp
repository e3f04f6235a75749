// SPDX-License-Identifier: Apache-2.0
// Files with more than one scene: models alone, data files read by check, scenes that make data; and an early Ctrl-C.
#include "command_support.h"

namespace dpde::testing {
namespace {

std::string with(std::string text, const std::string& old, const std::string& fresh) {
  text.replace(text.find(old), old.size(), fresh);
  return text;
}

using LoneModel = Command;

TEST_F(LoneModel, ItsMistakesAreTold) {
  write("m.dpde", "model m {\n  field u\n  param nu\n  dt(u) = nu*lap(u) + sine(u)\n}\n");
  for (const std::string verb : {"check", "run"}) {
    const Outcome outcome = dpde(verb + " m.dpde --json");
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0302"}) << outcome.err;
    EXPECT_EQ(outcome.json()["diagnostics"][0]["line"], 4);
  }
}

using CheckFiles = Command;

TEST_F(CheckFiles, MissingAndWrongOnesAreTold) {
  write("rod.dpde", with(rod_text, "initial u = sin(x)", "initial u = load(\"none.npy\")"));
  const Outcome missing = dpde("check rod.dpde rod --json");
  EXPECT_EQ(missing.status, 2);
  EXPECT_EQ(missing.codes(), std::vector<std::string>{"E0901"});
  EXPECT_EQ(missing.json()["diagnostics"][0]["line"], 10);
  write("rod.dpde", with(rod_text, "unknown k", "data r = load(\"text.npy\")\n  unknown k"));
  write("text.npy", "no array");
  EXPECT_EQ(dpde("check rod.dpde find --json").codes(), std::vector<std::string>{"E0907"});
  EXPECT_EQ(dpde("check rod.dpde rod --json").status, 0);  // the scene alone needs no data
}

class DataScene : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    std::string text =
        with(rod_text, "unknown k from 0.25", "data r = u from scene truth at t = 1\n  unknown k from 0.25");
    text = with(text, "mean(u^2) at t = 1", "mean((u - r)^2) at t = 1");
    text +=
        "scene truth : heat with ftcs {\n  grid x = 0 .. 2*pi, cells 32, periodic\n  k = 0.3\n  initial u = sin(x)\n"
        "  time 0 .. 1, step 1/32\n}\n";
    write("rod.dpde", text);
  }
};

TEST_F(DataScene, FollowsTheCellsOfTheTask) {
  for (const std::string cells : {"16", "32", "20", "40"}) {
    const Outcome fit = dpde("optimize rod.dpde find --json --set step=1/32 --iterations 30 --set cells=" + cells);
    ASSERT_EQ(fit.status, 0) << fit.err;
    EXPECT_NEAR(fit.json()["unknowns"]["k"]["value"], 0.3, 0.01) << cells;
  }
}

TEST_F(DataScene, FollowsTheEnd) { EXPECT_EQ(dpde("gradient rod.dpde find --json --set end=2").status, 0); }

TEST_F(DataScene, ASceneThatNeverFittedIsRefused) {
  write("rod.dpde", with(content(path("rod.dpde")), "cells 32", "cells 24"));
  EXPECT_EQ(dpde("gradient rod.dpde find --json").codes(), std::vector<std::string>{"E0909"});
}

using NotANumber = Command;

TEST_F(NotANumber, HasNoSign) {
  write("bad.dpde",
        "model m {\n  field u\n  dt(u) = 0*(-sqrt(-u))\n}\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  "
        "initial u = 1 + x\n"
        "  time 0 .. 4, step 1/8\n}\n");
  write("bad.dpde", with(content(path("bad.dpde")), "0*(-sqrt(-u))", "-sqrt(-u)"));
  const Outcome run = dpde("run bad.dpde --json");
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("the value is nan"), std::string::npos) << run.err;
  EXPECT_EQ((run.err + run.out).find("-nan"), std::string::npos) << run.err;
}

using EarlyCtrlC = Command;

/// The signal arrives before, during and after the C++ compiler: no folder may remain.
TEST_F(EarlyCtrlC, LeavesNoTemporaryFolders) {
  write("rod.dpde", rod_text);
  fs::create_directories(path("tmp"));
  for (const std::string wait : {"0.01", "0.03", "0.06", "0.1", "0.2", "0.4"}) {
    shell("export TMPDIR=$PWD/tmp; timeout -s INT " + wait +
          " $DPDE run rod.dpde rod --backend cpp --no-cache --quiet --set end=1000");
    EXPECT_TRUE(fs::is_empty(path("tmp"))) << wait;
  }
}

/// A sum that takes long to compile, and a signal in the middle: the first one ends the command regularly.
TEST_F(EarlyCtrlC, IsHeardWhileCompiling) {
  std::string sum = "k*lap(u)";
  for (int i = 1; i <= 900; ++i)
    sum += " + 0.001*sin(" + std::to_string(i) + "*u)*exp(-u^2/" + std::to_string(i + 1) + ")";
  write("sum.dpde", with(rod_text, "k*lap(u)", sum));
  fs::create_directories(path("tmp"));
  std::vector<Outcome> all;
  for (const std::string verb : {"check", "verify", "gradient", "optimize", "emit --stage adjoint"}) {
    Outcome stopped = interrupted(verb + " sum.dpde find", "0.05");
    for (const char* later : {"0.2", "0.8"}) {  // on a busy machine the first signal arrives before main()
      if (stopped.err.empty()) stopped = interrupted(verb + " sum.dpde find", later);
    }
    all.push_back(stopped);
  }
  all.push_back(
      shell("export TMPDIR=$PWD/tmp; timeout --preserve-status -k 30 -s INT 1 $DPDE run sum.dpde rod --backend cpp"));
  for (const Outcome& stopped : all) {
    EXPECT_EQ(stopped.status, by_ctrl_c) << stopped.err;
    EXPECT_NE(stopped.err.find("error[E0807]: stopped before"), std::string::npos) << stopped.err;
  }
  EXPECT_TRUE(fs::is_empty(path("tmp")));
}

}  // namespace
}  // namespace dpde::testing
