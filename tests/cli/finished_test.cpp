// SPDX-License-Identifier: Apache-2.0
// Finished data sets and searches: --resume reports this and repeats nothing. Also files that conflict with them or are
// inconsistent.
#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string wave_equation = R"(
model burgers { field u; param nu, a; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 1, step 1/32
}
dataset train : fine { runs 3; vary a in 0.5 .. 1.5; frames every 1/8; coarsen 2; file "train.nc" }
scene pushed : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; initial u = a*sin(x); time 0 .. 1, step 1/8 }
task learn : pushed { data r = trajectories("train.nc", u); unknown nu; minimise mean((u - r)^2) over 2 steps; using adam(rate = 0.01), batch 8, epochs 1 }
)";

class Finished : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("waves.dpde", wave_equation);
  }
  Outcome make(const std::string& more = "", const std::string& file = "waves.dpde") const {
    return dpde("run " + file + " train --out . " + more);
  }
};

TEST_F(Finished, DataSetsAreNotMadeAgain) {
  const Outcome first = make("--json");
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_TRUE(first.json()["finished"]);
  const std::string bytes = content(path("train.nc")), cost = content(path("train.nc.cost"));
  const Outcome again = make("--resume --json");
  ASSERT_EQ(again.status, 0) << again.err;
  for (const char* key : {"runs", "frames", "cells", "estimates", "conservation", "residuals", "finished"})
    EXPECT_EQ(again.json()[key], first.json()[key]) << key;
  EXPECT_EQ(again.json()["resumed_runs"], 3);
  EXPECT_EQ(content(path("train.nc.cost")), cost) << "nothing was measured again";
  const Outcome words = make("--resume");
  EXPECT_NE(words.out.find("train: all runs are made already, train.nc is there\ntrain: 3 runs of scene fine, 9 frames "
                           "from t = 0 to 1 on 16 cells\n"),
            std::string::npos)
      << words.out;
  EXPECT_NE(words.out.find("its integral drifts by at most"), std::string::npos) << words.out;
  ASSERT_EQ(make().status, 0);
  EXPECT_EQ(content(path("train.nc")), bytes) << "without --resume it is made again, of the same bytes";
}

TEST_F(Finished, OtherDataSetsAndDamagedOnesAreMade) {
  ASSERT_EQ(make().status, 0);
  std::string other = wave_equation;
  other.replace(other.find("runs 3"), 6, "runs 4");
  write("other.dpde", other);
  EXPECT_EQ(make("--resume --json", "other.dpde").json()["resumed_runs"], 0);
  ASSERT_EQ(make().status, 0);
  std::string bytes = content(path("train.nc"));
  bytes[bytes.size() / 2] ^= 1;
  write("train.nc", bytes);
  const Outcome again = make("--resume --json");
  EXPECT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(again.json()["resumed_runs"], 0);
  write("train.nc", "not a file of dpde");
  EXPECT_EQ(make("--resume --json").json()["resumed_runs"], 0);
}

TEST_F(Finished, FoldersInTheWayAreToldBeforeTheRuns) {
  for (const std::string name : {"train.nc.cost", "train.nc"}) {
    fs::create_directory(path(name));
    const Outcome outcome = make("--json");
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0902"}) << outcome.err;
    EXPECT_NE(outcome.err.find(name + ": it is a folder"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(path("train.nc.0"))) << "no run was made";
    fs::remove(path(name));
  }
}

TEST_F(Finished, CostsAreNotBelievedBlindly) {
  ASSERT_EQ(make().status, 0);
  const std::string good = content(path("train.nc.cost")), head = good.substr(0, good.find("cpu_s ") + 6);
  for (const std::string number : {"1e300", "1 2", "-1", "nan", "inf", "", "one", "1\n2", "0x10"}) {
    write("train.nc.cost", head + number + "\n");
    const Outcome outcome = dpde("optimize waves.dpde learn --json");
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0907"}) << number << outcome.err;
    EXPECT_NE(outcome.err.find("train.nc.cost cannot be used"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("remove it"), std::string::npos) << outcome.err;
  }
  for (const std::string text : {"", "data 12\n", "something else"}) {
    write("train.nc.cost", text);
    EXPECT_EQ(dpde("optimize waves.dpde learn --json").codes(), std::vector<std::string>{"E0907"}) << text;
  }
  for (const std::string number : {"0", "12.5", "1e3"}) {
    write("train.nc.cost", head + number + "\n");
    EXPECT_EQ(dpde("optimize waves.dpde learn --json").status, 0) << number;
  }
  fs::remove(path("train.nc.cost"));
  EXPECT_EQ(dpde("optimize waves.dpde learn --json").status, 0);
  fs::create_directory(path("train.nc.cost"));
  EXPECT_EQ(dpde("optimize waves.dpde learn --json").codes(), std::vector<std::string>{"E0901"});
}

}  // namespace
}  // namespace dpde::testing
