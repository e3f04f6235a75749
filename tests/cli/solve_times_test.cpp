// SPDX-License-Identifier: Apache-2.0
// Iterations and seconds are reported for all solves: the savings of a guess are measured, not assumed.
#include <set>

#include "command_support.h"

namespace dpde::testing {
namespace {

class SolveTimes : public Command {};

/// `base` starts from 0, `warm` from the last solution.
const std::string vortices =
    "model m { field w; param k; solve lap(psi) - psi = -w for psi; dt(w) = k*psi }\n"
    "scheme c { time = euler; solve = cg(1e-8); preconditioner = none; guess = none }\n"
    "scheme d { time = euler; solve = cg(1e-8); preconditioner = none; guess = last }\n"
    "scene base : m with c { grid x = 0 .. 1, cells 12; grid y = 0 .. 1, cells 10; k = 0.1\n"
    "  boundary psi: all = 0; boundary w: all = 0; initial w = exp(x)*y; time 0 .. 0.8, step 0.1 }\n"
    "scene warm = base with d {}\n"
    "dataset made : base { runs 2; seed 1; vary k in 0.1 .. 0.2; frames every 0.1; file \"made.nc\" }\n"
    "task g : base { unknown k; minimise mean(psi^2) over time }\n"
    "task t : base {\n  data r = trajectories(\"made.nc\", w)\n  unknown k from 0.1\n"
    "  minimise mean((w - r)^2) over 2 steps\n  using adam(rate = 1e-3), batch 2, epochs 1\n"
    "  test error = mean((w - r)^2) on trajectories(\"made.nc\") for 4 steps "
    "beside warm on trajectories(\"made.nc\")\n}\n";

struct Told {
  double each = 0, seconds = 0;
};
Told told(const Json& solve) {
  EXPECT_GT(solve["solves"].get<int>(), 0) << solve;
  EXPECT_EQ(solve["method"], "cg");
  EXPECT_GE(solve["setup_s"].get<double>(), 0);
  return {solve["iterations"].get<double>() / solve["solves"].get<double>(), solve["cpu_s"].get<double>()};
}

TEST_F(SolveTimes, AreToldOfRunsGradientsAndTests) {
  write("s.dpde", vortices);
  const Outcome run = dpde("run s.dpde base --json"), warm = dpde("run s.dpde warm --json");
  ASSERT_EQ(run.status, 0) << run.err;
  ASSERT_EQ(warm.status, 0) << warm.err;
  const Json cold_solve = run.json()["solves"][0], warm_solve = warm.json()["solves"][0];
  EXPECT_LT(told(warm_solve).each, 0.8 * told(cold_solve).each);
  EXPECT_GT(told(cold_solve).seconds, 0);
  EXPECT_LT(told(cold_solve).seconds, run.json()["wall_s"].get<double>() + 1);
  EXPECT_EQ(cold_solve["guess"], "");
  EXPECT_EQ(warm_solve["guess"], "psi_last");
  EXPECT_NE(dpde("run s.dpde warm").out.find(" ms a solve"), std::string::npos);

  const Outcome gradient = dpde("gradient s.dpde g --json");
  ASSERT_EQ(gradient.status, 0) << gradient.err;
  std::set<std::string> fields;  // also those of the losses, forward and backward
  for (const Json& solve : gradient.json()["solves"]) {
    EXPECT_GT(told(solve).seconds, 0) << solve;
    fields.insert(solve["field"].get<std::string>());
  }
  EXPECT_EQ(fields, (std::set<std::string>{"psi", "the adjoint of psi"}));
}

TEST_F(SolveTimes, AreToldOfTestsAndScenesBeside) {
  write("s.dpde", vortices);
  ASSERT_EQ(dpde("run s.dpde made --out .").status, 0);
  const Outcome learnt = dpde("optimize s.dpde t --json --out o --beside-named-only");
  ASSERT_EQ(learnt.status, 0) << learnt.err;
  const Json test = learnt.json()["test"]["error"];
  const Told own = told(test["solves"][0]), beside = told(test["beside"]["warm"]["solves"][0]);
  EXPECT_GT(own.seconds, 0);
  EXPECT_LT(beside.each, 0.8 * own.each);
  const std::string table = content(path("o/error_beside.csv"));
  EXPECT_TRUE(table.substr(0, table.find('\n')).ends_with(",solves,iterations,solve_s,run_0,run_1")) << table;
  const std::string said = dpde("test s.dpde t --beside-named-only").out;
  for (const char* scene : {"base", "warm"})
    EXPECT_NE(said.find(std::string("    ") + scene + ", solve for psi: cg, "), std::string::npos) << said;
}

}  // namespace
}  // namespace dpde::testing
