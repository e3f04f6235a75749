// SPDX-License-Identifier: Apache-2.0
// Failures of the machine, interruptions by the user, and failing derivatives: codes, exit status, no partial files.
#include "command_support.h"

namespace dpde::testing {
namespace {

class Machine : public Command {
 protected:
  std::string example(const std::string& name) const { return DPDE_SOURCE_DIR "/dsl-examples/" + name; }
};

TEST_F(Machine, UnwritableFolderIsItsFault) {
  const Outcome outcome = dpde("run " + example("heat/heat.dpde") + " rod --out /proc/nothing --json --quiet");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0902"});
}

TEST_F(Machine, TooLittleMemoryIsItsFault) {
  if (is_sanitized) GTEST_SKIP() << "the sanitizers reserve more address space than the test allows";
  const Outcome outcome =
      shell("ulimit -v 1500000; $DPDE run " + example("heat/heat.dpde") + " block --set cells=512 --json --quiet");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0903"});
}

/// Process limits do not apply to root; stacks larger than any address space make threads fail in the same way.
TEST_F(Machine, AThreadThatCannotBeMadeIsTold) {
  if (is_sanitized) GTEST_SKIP() << "the sanitizers end a program whose threads cannot be made";
  write("rod.dpde", rod_text);
  const std::string no_threads = "ulimit -s 99999999999 || exit 99; ";
  if (shell(no_threads + "true").status == 99) GTEST_SKIP() << "stacks have a limit here that cannot be raised";
  for (const std::string arguments : {"check rod.dpde rod", "run rod.dpde rod", "gradient rod.dpde find",
                                      "optimize rod.dpde find", "verify rod.dpde find", "stability rod.dpde rod"}) {
    const Outcome outcome = shell(no_threads + "$DPDE " + arguments + " --json --threads 4");
    EXPECT_EQ(outcome.status, 3) << arguments;
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0903"}) << arguments << outcome.err;
    EXPECT_NE(outcome.err.find("no further thread"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("ulimit -u"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("--threads 1"), std::string::npos) << outcome.err;
  }
}

/// As with `head`: the reader closes the pipe before the command has written everything. Text that fills the pipe, text
/// written at the end, errors, files.
TEST_F(Machine, AReaderThatIsGoneEndsNothing) {
  write("rod.dpde", rod_text);
  const auto without_reader = [&](const std::string& arguments) {
    const Outcome outcome =
        shell("{ while [ ! -e gone ]; do sleep 0.01; done; $DPDE " + arguments +
              "; echo $? > status; } | { exec 0<&-; : > gone; }; while [ ! -s status ]; do sleep 0.01; done; rm gone");
    EXPECT_EQ(outcome.err.find("E090"), std::string::npos) << outcome.err;
    const std::string status = content(path("status"));
    fs::remove(path("status"));
    return status;
  };
  for (const std::string arguments : {"man", "--help", "explain E0609", "emit rod.dpde rod --stage llvm",
                                      "check rod.dpde rod", "run rod.dpde rod --json", "gradient rod.dpde find"})
    EXPECT_EQ(without_reader(arguments), "0\n") << arguments;
  EXPECT_EQ(without_reader("run rod.dpde rod --set cells=4096"), "2\n");
  EXPECT_EQ(without_reader("run rod.dpde rod --out there"), "0\n");
  EXPECT_TRUE(fs::exists(path("there/u.npy")));
  EXPECT_EQ(shell("$DPDE man > /dev/full").status, 3) << "what cannot be written is told as ever";
}

TEST_F(Machine, NonsenseOptionIsTheUsersFault) {
  const Outcome outcome = dpde("gradient " + example("heat/heat.dpde") + " recover --memory lots --json");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0904"});
}

TEST_F(Machine, ABudgetThatIsTooSmallIsToldAtTheTask) {
  for (const std::string verb : {"gradient", "check"}) {
    const Outcome outcome = dpde(verb + " " + example("heat/heat.dpde") + " recover --memory 100");
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("heat.dpde:65:6: error[E0904]: a checkpoint budget of 100 bytes is too small"),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("\n  task recover : "), std::string::npos) << outcome.err;
  }
}

TEST_F(Machine, InterruptedOptimisationKeepsWhatItHas) {
  const Outcome outcome = interrupted(
      "optimize " + example("burgers_2d/burgers_2d.dpde") + " recover --iterations 1000000 --json --quiet --out here",
      "0", "here/optimiser.log");
  EXPECT_EQ(outcome.status, by_ctrl_c);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0806"});
  EXPECT_TRUE(fs::exists(path("here/loss.csv")));
}

TEST_F(Machine, InterruptedGradientHasNoNumber) {
  const Outcome outcome = interrupted(
      "gradient " + example("heat/heat.dpde") + " recover --set step=1/4000000 --memory 1M --json --quiet", "0.3");
  EXPECT_EQ(outcome.status, by_ctrl_c);
  EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0807"});
}

/// The certificate needed runs, so "nothing was run" would be wrong. The data come from 1e9 steps of another scene.
TEST_F(Machine, InterruptedPreparationSaysSo) {
  write("long.dpde", R"(
model heat { field u; param k; dt(u) = k*lap(u) }
scene fine : heat { grid x = 0 .. 1, cells 16, periodic
  k = 1e-3
  initial u = sin(2*pi*x)
  time 0 .. 1, step 1e-9 }
scene s : heat { grid x = 0 .. 1, cells 16, periodic
  k = 1e-3
  initial u = sin(2*pi*x)
  time 0 .. 1, step 0.1 }
task t : s { data r = u from scene fine at t = 1
  unknown k from 1e-3
  minimise mean((u - r)^2) at t = 1 }
)");
  const Outcome outcome = interrupted("gradient long.dpde t", "0.5");
  EXPECT_EQ(outcome.status, by_ctrl_c);
  EXPECT_NE(outcome.err.find("error[E0807]: stopped before the task was prepared"), std::string::npos) << outcome.err;
}

/// Jumps closer together than any step of the Taylor test: no second-order remainder, so no certificate.
TEST_F(Machine, WhatHasNoSlopeIsNotCertified) {
  write("jumps.dpde", R"(
model jumps { field u; dt(u) = if(sin(1e7*u) > 0, u, -u) }
scheme e { time = euler }
scene s : jumps with e { grid x = 0 .. 1, cells 64, periodic
  initial u = x
  time 0 .. 1, step 0.5 }
task t : s { unknown initial u
  minimise sum(u^2) }
)");
  const Outcome refused = dpde("verify jumps.dpde t --json");
  EXPECT_EQ(refused.status, 1);
  EXPECT_EQ(refused.codes(), (std::vector<std::string>{"W0609", "E0804"})) << "it jumps";
  EXPECT_FALSE(refused.json()["passed"].get<bool>());
}

/// A kink next to the point: only the largest steps cross it, and the gradient is exact.
TEST_F(Machine, AKinkBesideThePointIsCertified) {
  write("kink.dpde", R"(
model kink { field u; dt(u) = abs(u - 0.5) }
scheme e { time = euler }
scene s : kink with e { grid x = 0 .. 1, cells 8, periodic
  initial u = 0.5
  time 0 .. 1, step 0.5 }
task t : s { unknown initial u
  minimise sum(u) }
)");
  EXPECT_EQ(dpde("verify kink.dpde t --json").status, 0);
}

}  // namespace
}  // namespace dpde::testing
