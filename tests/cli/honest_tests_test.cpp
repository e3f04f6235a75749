// SPDX-License-Identifier: Apache-2.0
// Problems with a task's tests are reported by every command that uses them: a wrong source, settings and weights that
// are not used, files that would be overwritten, runs that end, Ctrl-C.
#include "command_support.h"
#include "learning_scenes.h"

namespace dpde::testing {
namespace {

const std::string honest_scenes = scenes_without_network + R"(
network first(u) { real f64; initial he, seed 1; conv 2, 3; tanh; conv out, 1, gain = 0.01 }
scene coarse = fine { cells 8; after step: u += first(u) }
scene loaded = coarse { first = load("own.safetensors") }
)";

std::string honest_task(const std::string& tests) {
  return "task learn : coarse {\n  data r = trajectories(\"train.nc\", u)\n"
         "  learn first; unknown nu from 0.04\n  minimise mean((u - r)^2) over 2 steps\n"
         "  using adam(rate = 1e-3), batch 4, epochs 1\n" +
         tests + "}\n";
}
std::string honest_test(const std::string& name, const std::string& behind = "") {
  return "  test " + name + " = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 8 steps" + behind + "\n";
}

class HonestTests : public Command {
 protected:
  void make_data(const std::string& tests) const {
    write("t.dpde", honest_scenes + honest_task(tests));
    for (const std::string set : {"train", "unseen"}) ASSERT_EQ(dpde("run t.dpde " + set + " --out .").status, 0);
  }
  std::vector<std::string> codes_of(const std::string& arguments) const { return dpde(arguments + " --json").codes(); }
};

using Codes = std::vector<std::string>;

TEST_F(HonestTests, EveryVerbTellsWhatIsWrongInTheSource) {
  write("t.dpde", honest_scenes + honest_task(honest_test("err", " beside bear")));
  for (const char* arguments :
       {"optimize t.dpde learn", "optimize t.dpde learn --epochs 1", "optimize t.dpde learn --iterations 1",
        "test t.dpde learn", "test t.dpde learn --from o", "verify t.dpde learn", "bench t.dpde learn",
        "chart t.dpde learn", "chart t.dpde learn --budget", "check t.dpde learn"})
    EXPECT_EQ(codes_of(arguments), Codes{"E0318"}) << arguments;
  EXPECT_EQ(codes_of("optimize t.dpde learn --epochs 1 --set nu"), Codes{"E0904"}) << "once";
}

TEST_F(HonestTests, NoFileIsWrittenOverAnother) {
  const auto codes = [&](const std::string& tests) {
    write("t.dpde", honest_scenes + honest_task(tests));
    Codes codes = codes_of("check t.dpde learn");
    std::erase(codes, "E0901");  // there are no data
    return codes;
  };
  const std::string err = honest_test("err", " beside bare");
  EXPECT_EQ(codes(honest_test("epochs")), Codes{"E0303"});
  EXPECT_EQ(codes(err + honest_test("err_beside")), Codes{"E0303"});
  EXPECT_EQ(codes(honest_test("err_chart") + err), Codes{"E0303"});
  EXPECT_EQ(codes(honest_test("loss")), Codes{"E0304"});
  EXPECT_EQ(codes(err + honest_test("epochs_of") + honest_test("other_beside")), Codes{});
  EXPECT_EQ(codes(honest_test("err") + honest_test("err_beside")), Codes{}) << "nothing is beside it";
  const std::string search =
      "model growing { field u; coefficient u_initial; dt(u) = u_initial*u }\nscene s : growing {\n"
      "  grid x = 0 .. 1, cells 4, periodic\n  u_initial = 1\n  initial u = 1 + x\n  time 0 .. 1, step 0.1\n}\n";
  write("s.dpde", search +
                      "task loss : s { unknown initial u; minimise mean(u^2) }\n"
                      "task both : s { unknown initial u; unknown u_initial; minimise mean(u^2) }\n");
  EXPECT_EQ(codes_of("check s.dpde loss"), Codes{"E0303"});
  EXPECT_EQ(codes_of("check s.dpde both"), Codes{"E0303"});
}

/// Settings that no run uses, weights without training, unused weight files.
TEST_F(HonestTests, WhatIsNotTakenIsTold) {
  make_data(honest_test("err"));
  ASSERT_EQ(dpde("optimize t.dpde learn --out o --beside-named-only").status, 0);
  for (const char* verb : {"test", "optimize"}) {
    const std::string call = std::string(verb) + " t.dpde learn";
    const Outcome ignored = dpde(call + " --json --set phase=1");
    EXPECT_EQ(ignored.status, 0) << ignored.err;
    EXPECT_NE(ignored.err.find("warning[W0902]"), std::string::npos) << ignored.err;
    EXPECT_NE(ignored.err.find("one a run"), std::string::npos) << ignored.err;
    EXPECT_EQ(codes_of(call + " --set nu=0.05"), Codes{}) << "which is the task's to find";
  }
  const std::string untrained = "network first is not trained";
  const auto says = [&](const std::string& arguments) {
    return dpde("test t.dpde learn --beside-named-only" + arguments).out;
  };
  EXPECT_NE(says("").find(untrained), std::string::npos);
  EXPECT_EQ(says(" --from o").find(untrained), std::string::npos);
  EXPECT_EQ(says(" --weights o/first.safetensors").find(untrained), std::string::npos);
  fs::copy(path("o/first.safetensors"), path("own.safetensors"));
  write("t.dpde", honest_scenes + honest_task(honest_test("err", " beside bare, loaded")));
  const std::string with = says(" --beside-named-only --from o");
  EXPECT_NE(with.find("not with those of own.safetensors"), std::string::npos) << with;
}

TEST_F(HonestTests, DamageOfWhatDataHaveCostIsToldByEveryVerb) {
  make_data(honest_test("err"));
  ASSERT_EQ(dpde("optimize t.dpde learn --out o --beside-named-only").status, 0);
  const std::string cost = content(path("train.nc.cost"));
  for (const char* file : {"train.nc.cost", "unseen.nc.cost"}) {
    const std::string good = content(path(file));
    write(file, "junk");
    EXPECT_EQ(codes_of("test t.dpde learn --from o"), Codes{"E0907"}) << file;
    EXPECT_EQ(codes_of("optimize t.dpde learn"), Codes{"E0907"}) << file;
    write(file, good);
  }
  EXPECT_EQ(codes_of("test t.dpde learn --from o"), Codes{});
}

/// With or without trajectories, after a training or not.
TEST_F(HonestTests, WithoutAFiniteNumberTheyHaveFailed) {
  make_data(honest_test("err") + "  statistic energy = mean(u^2) on trajectories(\"unseen.nc\") for 8 steps\n");
  const Outcome burst = dpde("test t.dpde learn --set nu=1e60 --json");
  EXPECT_EQ(burst.status, 1) << burst.err;
  EXPECT_EQ(burst.codes(), (Codes{"E0807", "E0807"}));
  EXPECT_EQ(burst.json()["test"]["err"]["mean"], "inf");
  std::string text = content(path("t.dpde"));
  text.replace(text.find("unknown nu from 0.04"), 20, "unknown nu from 1e60");
  text +=
      "task find : fine {\n  data seen = u from scene bare\n  unknown nu from 1e60\n  minimise 1e-3*nu\n"
      "  using lbfgs(), iterations 1\n  test far = mean(abs(u))\n}\n";
  write("t.dpde", text);
  EXPECT_EQ(dpde("test t.dpde learn --json").status, 1);
  const Outcome found = dpde("test t.dpde find --force --json");
  EXPECT_NE(found.status, 0) << found.err;
}

TEST_F(HonestTests, StoppedByCtrlCSayHowTheyAreRun) {
  make_data(honest_test("err", " beside bare"));
  const Outcome stopped = interrupted("optimize t.dpde learn --out o --json", "0", "o/epochs.csv");
  EXPECT_EQ(stopped.codes(), Codes{"E0807"}) << stopped.err;
  EXPECT_NE(stopped.err.find("stopped before all tests were run"), std::string::npos) << stopped.err;
  EXPECT_NE(stopped.err.find("dpde test t.dpde learn --from o"), std::string::npos) << stopped.err;
  EXPECT_EQ(stopped.json()["test"], Json::object());
  EXPECT_EQ(dpde("test t.dpde learn --from o --beside-named-only").status, 0);
}

}  // namespace
}  // namespace dpde::testing
