// SPDX-License-Identifier: Apache-2.0
// Kinds of solves x parts of training: data sets and samples of runs without a solution. The table of other callers is
// tests/hosts/solve_table_test.cpp.
#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct SolveFailure {
  std::string name, model, scheme, fields, said, code;
};

/// The factor exp(k) overflows from k = 710 on.
const std::vector<SolveFailure> solve_failures = {
    {"declared", "field u\n  solve psi - exp(k)*lap(psi) = u for psi\n  dt(u) = psi - u", "euler",
     "boundary psi: all = 0\n  boundary u: all = zero_gradient", "solve for psi: the operator is not finite", "E0814"},
    {"newton", "field u\n  dt(u) = lap(u) - exp(k)*u^3", "backward_euler; implicit = all", "boundary u: all = 0",
     "newton for u_solved: ", "E0815"},
    {"stage", "field u\n  dt(u) = exp(k)*lap(u)", "backward_euler", "boundary u: all = 0",
     "solve for u_solved: the operator is not finite", "E0814"},
};

std::string text_of(const SolveFailure& kind, const std::string& k, const std::string& from,
                    const std::string& optimiser) {
  return "model m { param k; param a\n  " + kind.model + " }\nscheme c { time = " + kind.scheme +
         " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 12\n  grid y = 0 .. 1, cells 10\n  k = " + k +
         "\n  a = 1\n  " + kind.fields +
         "\n  initial u = a*sin(3*x)*y\n  time 0 .. 0.4, step 0.1\n}\n"
         "dataset d : s { runs 2; seed 1; vary a in 1 .. 2; frames every 0.1; file \"d.nc\" }\n"
         "task t : s { data r = trajectories(\"d.nc\", u); unknown k from " +
         from + "; minimise mean((u - r)^2) over 2 steps; using " + optimiser + ", batch 2, epochs 3 }\n";
}

class TrainingSolves : public Command {};

TEST_F(TrainingSolves, WhatHasNoSolutionIsSaidAndTheBestKept) {
  for (const SolveFailure& kind : solve_failures) {
    if (kind.name == "stage" && !is_thorough()) continue;
    SCOPED_TRACE(kind.name);
    write("d.dpde", text_of(kind, "0", "-0.1", "adam(rate = 0.1)"));
    ASSERT_EQ(dpde("run d.dpde d --out . --json").status, 0);
    write("far.dpde", text_of(kind, "0", "-0.1", "gradient_descent(rate = 1e12)"));  // the first step is far too long
    const Outcome far = dpde("optimize far.dpde t --json");
    EXPECT_EQ(far.codes(), std::vector<std::string>{"E0803"}) << far.out;
    EXPECT_EQ(far.json()["unknowns"]["k"]["value"], -0.1);
    write("none.dpde", text_of(kind, "800", "800", "adam(rate = 0.1)"));
    const Outcome none = dpde("optimize none.dpde t --json");
    EXPECT_EQ(none.codes(), std::vector<std::string>{"E0803"}) << none.out;
    EXPECT_NE(none.err.find("in epoch 1, from frame 1 of run 1: step 1 of 2 (t = 0.1): " + kind.said),
              std::string::npos)
        << none.err;
    const Outcome made = dpde("run none.dpde d --out none --json");
    EXPECT_EQ(made.codes(), std::vector<std::string>{kind.code}) << made.out;
    EXPECT_NE(made.err.find("error[" + kind.code + "]: run 0 of dataset d: step 1 of 4 (t = 0): " + kind.said),
              std::string::npos)
        << made.err;
  }
}

}  // namespace
}  // namespace dpde::testing
