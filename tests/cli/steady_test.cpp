// SPDX-License-Identifier: Apache-2.0
// Runs until steady, and messages about their equations.
#include "command_support.h"

namespace dpde::testing {
namespace {

using SteadyCommand = Command;

const std::string warm_rod =
    "model rod { field u; param k; dt(u) = k*lap(u) + 1 }\nscheme c { time = euler }\nscene line : rod with c {\n"
    "  grid x = 0 .. 1, cells 8\n  k = 1\n  boundary u = 0\n  initial u = 0\n"
    "  time 0 .. 10, step 1/512, until steady 1e-9\n}\ntask t : line { unknown k; minimise mean(u) }\n";

TEST_F(SteadyCommand, SaysWhenItWasSteadyOrThatItWasNot) {
  write("s.dpde", warm_rod);
  const Outcome run = dpde("run s.dpde line --json --out o");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(run.json()["steady"]["reached"].get<bool>());
  EXPECT_LE(run.json()["steady"]["change"].get<double>(), 1e-9);
  EXPECT_LT(run.json()["time"].get<double>(), 4);
  const Outcome brief = dpde("run s.dpde line --json --set end=1 --out o");
  EXPECT_EQ(brief.status, 1);
  EXPECT_EQ(brief.codes(), std::vector<std::string>{"E0811"}) << brief.err;
  EXPECT_FALSE(brief.json()["steady"]["reached"].get<bool>());
  EXPECT_EQ(brief.json()["time"].get<double>(), 1);
}

/// From a checkpoint before the steady step, and from one at it.
TEST_F(SteadyCommand, GoesOnToTheSameEnd) {
  write("s.dpde", warm_rod);
  const auto steps = dpde("run s.dpde line --json --out whole").json()["steps"].get<int>();
  const std::string end = content(path("whole/u.npy"));
  ASSERT_FALSE(end.empty());
  for (const int every : {130, steps}) {
    const std::string run =
        "run s.dpde line --json --out o" + std::to_string(every) + " --checkpoint-every " + std::to_string(every);
    for (const char* const again : {"", " --resume", " --resume"}) {
      const Outcome outcome = dpde(run + again);
      EXPECT_EQ(outcome.status, 0) << outcome.err;
      EXPECT_EQ(outcome.json()["steps"].get<int>(), steps) << every << again;
      EXPECT_TRUE(content(path("o" + std::to_string(every) + "/u.npy")) == end) << every << again;
    }
  }
}

/// u is 1/k times a field independent of k.
TEST_F(SteadyCommand, GivesItsGradient) {
  write("s.dpde", warm_rod);
  const Json of_task = dpde("gradient s.dpde t --json").json();
  EXPECT_NEAR(of_task["gradient"]["k"]["value"].get<double>(), -of_task["loss"].get<double>(), 1e-9);
  EXPECT_LE(of_task["steady"]["residual"].get<double>(), 1e-12);
  EXPECT_EQ(of_task["checkpoints"]["stored"].get<int>(), 0);
  EXPECT_EQ(dpde("gradient s.dpde t --set end=1").status, 1);
}

std::string lengths(const std::string& right, const std::string& solve) {
  return "model m { field u; coefficient c; solve div(c*grad(psi)) = " + right +
         " for psi; dt(u) = 0.001*psi }\nscheme s { time = euler; solve = " + solve +
         " }\nscene s : m with s {\n  grid x = 0 .. 1, cells 16, periodic\n"
         "  grid y = 0 .. 1, cells 16, periodic\n  c = 1 + 0.9*sin(2*pi*x)*cos(2*pi*y)\n"
         "  initial u = sin(2*pi*x)\n  time 0 .. 1/64, step 1/128\n}\n";
}

TEST_F(SteadyCommand, TellsHowAnEquationWasSolved) {
  write("s.dpde", lengths("u", "gmres(1e-9)"));
  const Outcome run = dpde("run s.dpde");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("solve for psi: gmres (GMRES, preconditioned"), std::string::npos) << run.out;
  const Outcome json = dpde("run s.dpde --json");
  EXPECT_TRUE(json.codes().empty()) << json.err;
  const Json solve = json.json()["solves"][0];
  EXPECT_LE(solve["residual"].get<double>(), 1e-9);
  EXPECT_LT(solve["incompatible"].get<double>(), 1e-12);
  EXPECT_EQ(solve["solves"].get<int>(), 2);
}

TEST_F(SteadyCommand, WarnsOfARightSideOutOfReach) {
  write("s.dpde", lengths("u + 1", "automatic"));
  const Outcome run = dpde("run s.dpde --json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0810"}) << run.err;
  EXPECT_NEAR(run.json()["solves"][0]["incompatible"].get<double>(), std::sqrt(1 / 1.5), 1e-2);
}

TEST_F(SteadyCommand, TooFewIterationsAreAnErrorOrAWarning) {
  write("s.dpde", lengths("u", "cg(1e-12, 1, warn)"));
  const Outcome warned = dpde("run s.dpde --json");
  EXPECT_EQ(warned.status, 0) << warned.err;
  EXPECT_EQ(warned.codes(), std::vector<std::string>{"W0809"}) << warned.err;
  const Outcome failed = dpde("run s.dpde --json --set \"solve=cg(1e-12, 1)\"");
  EXPECT_EQ(failed.status, 1);
  EXPECT_NE(failed.err.find("solve for psi: after 1 iterations of cg"), std::string::npos) << failed.err;
}

/// The end is only the time to give up; no step has to hit it.
TEST_F(SteadyCommand, TheEndNeedNotBeAWholeNumberOfSteps) {
  write("s.dpde", R"(model rest { field u; dt(u) = 1 - u }
scene s : rest { grid x = 0 .. 1, cells 4, periodic; initial u = 0; time 0 .. 100.0037, step 0.1, until steady 1e-8 }
)");
  const Outcome run = dpde("run s.dpde --json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_LT(run.json()["time"].get<double>(), 50);
}

}  // namespace
}  // namespace dpde::testing
