// SPDX-License-Identifier: Apache-2.0
// Messages about runs that blow up: the field, and that the step is too large.
#include "command_support.h"

namespace dpde::testing {
namespace {

using Instability = Command;

std::string rod(const std::string& step, const std::string& more, const std::string& initial = "1e-30*sin(x)") {
  return "model rod { field u; param k; dt(u) = k*lap(u)" + more +
         " }\nscheme e { time = euler }\nscene s : rod with e {\n  grid x = 0 .. 2*pi, cells 16, periodic\n  k = 1\n  "
         "initial u = " +
         initial + "\n  time 0 .. 40*" + step + ", step " + step + "\n}\n";
}

/// From 1e-30 a source makes 1, a step that is too large makes 1e-10.
TEST_F(Instability, WhatGrowsBecauseItIsDrivenIsNoMistake) {
  write("driven.dpde", rod("0.01", " + 1"));
  EXPECT_EQ(dpde("run driven.dpde s --json").codes(), std::vector<std::string>{});
  write("unstable.dpde", rod("0.2", "", "1e-30*sin(x) + 1e-32*cos(8*x)"));
  EXPECT_EQ(dpde("run unstable.dpde s --force --json").codes(), std::vector<std::string>{"W0801"});
}

/// Rolls (Swift and Hohenberg 1977) of 2.5 cells, and of 10.
TEST_F(Instability, ChessboardsAreSaid) {
  write("rolls.dpde", R"(
model rolls { field u; dt(u) = 0.5*u - u - 2*lap(u) - lap(lap(u)) - u^3 }
scheme c { time = rk4 }
scene s : rolls with c {
  grid x = 0 .. 32*pi, cells 40, periodic
  initial u = 0.1*sin(x/8) + 0.01*noise(1)
  time 0 .. 40, step 1/8
})");
  const Outcome run = dpde("run rolls.dpde s --json");
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0815"}) << run.err;
  EXPECT_EQ(dpde("run rolls.dpde s --json --set cells=160 --set step=1/64 --force").codes(),
            std::vector<std::string>{});
}

/// Inviscid flow fills all waves of the grid; with some viscosity it is resolved.
TEST_F(Instability, TurbulenceThatItsGridDoesNotHoldIsSaid) {
  write("flow.dpde", R"(
model flow { field w; param nu = 0; solve lap(psi) = w for psi; dt(w) = -bracket(psi, w) + nu*lap(w) }
scheme c { dx = central(2); lap = central(2); time = rk4 }
scene s : flow with c {
  grid x = 0 .. 2*pi, cells 32, periodic
  grid y = 0 .. 2*pi, cells 32, periodic
  initial w = sin(4*x)*cos(3*y) + cos(x - 5*y) + 0.3*sin(3*x + y + 1)
  time 0 .. 120, step 0.05
})");
  EXPECT_EQ(dpde("run flow.dpde s --json").codes(), (std::vector<std::string>{"W0815", "W0815"}));  // along x and y
  EXPECT_EQ(dpde("run flow.dpde s --json --set nu=0.01").codes(), std::vector<std::string>{});
}

TEST_F(Instability, ObservablesThatAreNoNumbersAreSaid) {
  write("log.dpde",
        "model m { field u; dt(u) = -u }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  initial u = -1\n"
        "  observe entropy = mean(log(u))\n  time 0 .. 1, step 0.1\n}\n");
  EXPECT_EQ(dpde("run log.dpde s --json").codes(), std::vector<std::string>{"W0818"});
}

/// u reads c^3, which overflows before c does.
TEST_F(Instability, ABlowUpNamesTheFieldThatBlowsUp) {
  write("pair.dpde", R"(
model pair { field u, c; dt(u) = c^3 - u; dt(c) = 300*lap(c) - c }
scheme e { time = euler }
scene s : pair with e {
  grid x = 0 .. 2*pi, cells 16, periodic
  subcycle c in 4
  initial u = 1
  initial c = 1 + 0.01*sin(8*x)
  time 0 .. 100, step 0.1
})");
  const Outcome run = dpde("run pair.dpde s --force --json");
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0801"});
  const std::string hint = run.json()["diagnostics"][0]["hint"];
  EXPECT_EQ(hint.find("c has grown from 1.01 to "), 0u) << hint;
}

/// The initial state is uniform and stays so; its gradient does not.
TEST_F(Instability, AGradientThatOverflowsBlamesTheStep) {
  write("steep.dpde", rod("0.5", "", "1") + "task t : s { unknown initial u; minimise mean(cos(8*x)*(u - 2)^2) }\n");
  const std::string text = content(path("steep.dpde"));
  write("steep.dpde", std::string(text).replace(text.find("40*0.5"), 6, "400*0.5"));
  const Outcome run = dpde("gradient steep.dpde t --force");
  EXPECT_NE(run.err.find("E0803"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("a smaller step than 0.5 may help"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("begin elsewhere"), std::string::npos) << run.err;
  write("root.dpde",
        "model m { field u; dt(u) = -u }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  initial u = 0\n  time "
        "0 .. 1, step 1/8\n}\n"
        "task t : s { unknown initial u; minimise mean(sqrt(u)) }\n");
  EXPECT_NE(dpde("gradient root.dpde t").err.find("begin elsewhere"), std::string::npos);
}

/// Squares of 1e-200 underflow to 0.
TEST_F(Instability, NormsOfSmallGradientsAreNot0) {
  write("small.dpde",
        "model m { field u; param k; dt(u) = -k*u }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  k = 1\n  "
        "initial u = 1\n  time 0 .. 1, step 1/8\n}\n"
        "task t : s { unknown initial u; minimise 1e-200*mean(u) }\n");
  const Json u = dpde("gradient small.dpde t --json").json()["gradient"]["u"];
  EXPECT_NEAR(double(u["norm"]) / double(u["max"]), 2, 1e-12) << u;
}

/// The weights of weno follow the solution: the run blows up below the limit for frozen weights. Squares of its values
/// overflow at 1e154, where growth stops.
TEST_F(Instability, WeightsThatFollowTheSolutionAreNamed) {
  write("s.dpde",
        "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = weno(3); time = ssp_rk3 }\n"
        "scene s : m with c {\n  grid x = 0 .. 1, cells 64, periodic\n"
        "  initial u = 1.5 + tanh(40*(x - 0.3)) - tanh(40*(x - 0.7))\n  time 0 .. 100, step 0.025\n}\n");
  const Outcome run = dpde("run s.dpde s --json");
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0801"});
  const std::string hint = run.json()["diagnostics"][0]["hint"];
  EXPECT_NE(hint.find("stable up to 0.02541 with weights of weno and limiters as the run begins"), std::string::npos)
      << hint;
  EXPECT_NE(dpde("check s.dpde --all s").out.find("weights of weno and limiters: some runs blow up below it"),
            std::string::npos);
}

/// The front of sin(pi*x) is steepest at t = 1/pi; 64 cells do not resolve it at nu = 0.001, however short the steps.
TEST_F(Instability, RunsThatAreLostAtOneTimeAreNoMatterOfTheStep) {
  write("front.dpde", R"(
model burgers { field u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
scheme c { advect = central(2); time = rk4 }
scene ends : burgers with c {
  grid x = 0 .. 1, cells 64
  boundary u: x = 0
  nu = 0.001
  initial u = sin(pi*x)
  time 0 .. 0.5, step 1/4096
})");
  const Outcome run = dpde("stability front.dpde ends --json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(run.json()["measured"]["max_step"].is_null()) << run.out;
  EXPECT_NEAR(run.json()["measured"]["all_end_after"].get<double>(), 1 / 3.14159, 0.1) << run.out;
}

}  // namespace
}  // namespace dpde::testing
