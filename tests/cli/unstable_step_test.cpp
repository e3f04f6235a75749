// SPDX-License-Identifier: Apache-2.0
// Unstable steps are reported before the first one, with the largest stable step.
#include <fmt/format.h>

#include <algorithm>

#include "command_support.h"

namespace dpde::testing {
namespace {

using UnstableStep = Command;

std::string plate(const std::string& scheme, const std::string& rate, const std::string& time) {
  return "model m {\n  field u\n  param k\n  dt(u) = " + rate + "\n}\nscheme c { " + scheme + " }\n" +
         "scene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n  grid y = 0 .. 1, cells 16, periodic\n" +
         "  k = 0.5\n  initial u = sin(2*pi*x)\n  time " + time + "\n}\n" +
         "task t : s {\n  unknown k from 0.4\n  minimise mean(u^2) at t = 1\n  using lbfgs(), iterations 3\n}\n";
}

/// 0.5*lap(u), Euler, h = 1/16: dt <= h^2/(4*0.5) = 1/512.
TEST_F(UnstableStep, IsRefusedWithTheLargestThatWorksAndTheTermThatLimitsIt) {
  write("s.dpde", plate("lap = central(2); time = euler", "k*lap(u) + 0.1*u", "0 .. 1, step 1/128"));
  for (const std::string verb : {"run s.dpde s", "gradient s.dpde t", "optimize s.dpde t"}) {
    const Outcome run = dpde(verb + " --json");
    EXPECT_EQ(run.status, 2) << verb << run.err;
    ASSERT_EQ(run.codes(), std::vector<std::string>{"E0808"}) << verb << run.err;
    const Json d = run.json()["diagnostics"][0];
    EXPECT_EQ(d["line"], 4) << verb;
    EXPECT_EQ(d["column"], 11) << verb;
    EXPECT_NE(d["hint"].get<std::string>().find("--force"), std::string::npos) << d;
  }
  const std::string hint = dpde("run s.dpde s --json").json()["diagnostics"][0]["hint"];
  const std::string step = hint.substr(hint.find("step=") + 5, hint.find(" is stable") - hint.find("step=") - 5);
  EXPECT_NEAR(std::stod(step), 1.0 / 512, 0.02 / 512) << hint;
  const Outcome stable = dpde("run s.dpde s --json --set step=" + step);
  EXPECT_EQ(stable.status, 0) << stable.err;
  EXPECT_TRUE(stable.codes().empty()) << stable.err;
  EXPECT_EQ(dpde("run s.dpde s --json --force").codes(), std::vector<std::string>{"W0801"});
}

/// Growth that stays small until the end of a short run is only a warning.
TEST_F(UnstableStep, OfAShortRunIsAWarning) {
  write("s.dpde", plate("lap = central(2); time = euler", "k*lap(u)", "0 .. 3/500, step 1/500"));
  const Outcome run = dpde("run s.dpde s --json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0802"}) << run.err;
}

/// g| = |1 - 2*step/limit|, which would be 1 with four digits.
TEST_F(UnstableStep, OfHardlyMoreThanTheLimitTellsItsGrowth) {
  write("s.dpde", plate("lap = central(2); time = euler", "k*lap(u)", "0 .. 3/511.9, step 1/511.9"));
  const Outcome run = dpde("run s.dpde s --json");
  ASSERT_EQ(run.codes(), std::vector<std::string>{"W0802"}) << run.err;
  EXPECT_NE(run.err.find("by a factor of 1.00039"), std::string::npos) << run.err;
}

/// g| = sqrt(1 + nu^2) at pi/2 for central(2) and Euler; RK2 grows by nu^4/8, a hundredfold in 594 steps at nu = 0.5.
TEST_F(UnstableStep, OfSchemesWithoutAStableOneIsTold) {
  const auto wind = [](const std::string& time, const std::string& end) {
    return "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = central(2); time = " + time +
           " }\nscene s : m with c {\n  grid x = 0 .. 64, cells 64, periodic\n  initial u = sin(2*pi*x/64)\n  time 0 "
           ".. " +
           end + ", step 0.5\n}\n";
  };
  write("euler.dpde", wind("euler", "100"));
  const Outcome euler = dpde("run euler.dpde --json");
  EXPECT_EQ(euler.codes(), std::vector<std::string>{"E0809"}) << euler.err;
  EXPECT_NE(euler.err.find("factor of 1.118"), std::string::npos) << euler.err;
  EXPECT_NE(euler.err.find("time = ssp_rk3 is stable up to a step of 1.732"), std::string::npos) << euler.err;
  write("short.dpde", wind("rk2", "50"));
  const Outcome weak = dpde("run short.dpde --json");
  EXPECT_EQ(weak.codes(), std::vector<std::string>{"W0803"}) << weak.err;
  EXPECT_NE(weak.err.find("a hundredfold in 595 steps"), std::string::npos) << weak.err;
  write("long.dpde", wind("rk2", "1000"));
  EXPECT_EQ(dpde("run long.dpde --json").codes(), std::vector<std::string>{"E0809"});
}

/// A scene that makes data is judged like that of the task.
TEST_F(UnstableStep, OfASceneThatMakesDataIsRefused) {
  std::string text = plate("lap = central(2); time = euler", "k*lap(u)", "0 .. 1, step 1/520");
  text.insert(text.find("task t"),
              "scene fine : m with c {\n  grid x = 0 .. 1, cells 32, periodic\n"
              "  grid y = 0 .. 1, cells 32, periodic\n  k = 0.5\n  initial u = sin(2*pi*x)\n"
              "  time 0 .. 1, step 1/520\n}\n");
  text.replace(text.find("mean(u^2)"), 9, "mean((u - r)^2)");
  text.insert(text.find("  unknown"), "  data r = u from scene fine\n");
  write("s.dpde", text);
  for (const std::string verb : {"gradient", "optimize", "verify"}) {
    const Outcome run = dpde(verb + " s.dpde t --json");
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0808"}) << run.err;
    EXPECT_NE(run.err.find("scene fine: the step"), std::string::npos) << run.err;
  }
  const std::vector<std::string> forced = dpde("verify s.dpde t --json --force").codes();
  EXPECT_EQ(std::ranges::count(forced, "W0802"), 0) << "nobody asked";
  EXPECT_EQ(std::ranges::count(forced, "E0808"), 0);
}

/// 0.5*h^2/k is 1/51.2 at k = 0.1: the runs of a data set with larger k are refused, by their number.
TEST_F(UnstableStep, OfARunOfADataSetIsRefused) {
  const std::string text =
      "model m { field u; param k; dt(u) = k*lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 16, periodic\n  k = 0.1\n  initial u = sin(2*pi*x)\n  time 0 .. 2, step 0.02\n}\n";
  write("s.dpde", text + "dataset d : s { runs 3; seed 1; vary k in 0.15 .. 0.2; frames every 0.2; file \"d.nc\" }\n");
  const Outcome run = dpde("run s.dpde d --out . --json");
  EXPECT_EQ(run.status, 2) << run.err;
  EXPECT_NE(run.err.find("run 0 of dataset d: scene s: the step 0.02 is above"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(path("d.nc")));
  const Outcome forced = dpde("run s.dpde d --out . --json --force");
  EXPECT_EQ(forced.status, 0) << forced.err;
  EXPECT_TRUE(fs::exists(path("d.nc")));
  EXPECT_TRUE(forced.codes().empty()) << forced.err;
}

/// Data from a stable scheme can be used for training with an unstable one.
TEST_F(UnstableStep, OfASceneThatLearnsIsRefused) {
  const auto text = [](const std::string& scheme, double step) {
    return "model m { field u; param k; param a; dt(u) = k*lap(u) }\nscheme c { time = " + scheme +
           " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n  k = 0.2\n  a = 1\n"
           "  initial u = a*sin(2*pi*x)\n" +
           fmt::format("  time 0 .. 2, step {}\n}}\n", step) +
           "dataset d : s { runs 2; seed 1; vary a in 1 .. 2; frames every 0.04; file \"d.nc\" }\n"
           "task t : s { data r = trajectories(\"d.nc\", u); unknown k from 0.2; minimise mean((u - r)^2) over 4 steps;"
           " using adam(rate = 0.01), batch 2, epochs 1 }\n";
  };
  write("data.dpde", text("crank_nicolson", 0.04));
  ASSERT_EQ(dpde("run data.dpde d --out . --json").status, 0);
  write("s.dpde", text("euler", 0.04));
  const Outcome refused = dpde("optimize s.dpde t --json");
  EXPECT_EQ(refused.codes(), std::vector<std::string>{"E0808"}) << refused.err;
  EXPECT_NE(refused.err.find("--force"), std::string::npos);
  const std::vector<std::string> forced = dpde("optimize s.dpde t --json --force").codes();
  EXPECT_EQ(std::ranges::count(forced, "E0808"), 0);
}

/// More diffusion lowers the loss: the optimiser reaches the region where 1/520 exceeds h^2/(4*k), k > 0.508.
TEST_F(UnstableStep, OnTheWayOfAnOptimiserIsToldOnce) {
  std::string more = plate("lap = central(2); time = euler", "k*lap(u)", "0 .. 1/52, step 1/520");
  more.replace(more.find("at t = 1"), 8, "at t = 1/52");
  write("s.dpde", more);
  const Outcome run = dpde("optimize s.dpde t --json");
  ASSERT_EQ(run.codes(), std::vector<std::string>{"W0808"}) << run.err;
  EXPECT_NE(run.err.find("the largest stable one with k = "), std::string::npos) << run.err;
  more.replace(more.find("from 0.4"), 8, "from 0.4 in 0.1 .. 0.5");
  write("bounded.dpde", more);
  EXPECT_TRUE(dpde("optimize bounded.dpde t --json").codes().empty());
}

/// Slow verdicts are cached, but not for an optimiser's intermediate unknowns, which never recur.
TEST_F(UnstableStep, WhatAnOptimiserPassesIsNotKept) {
  write("s.dpde", R"(model m {
  field u, v, w
  param k
  dt(u) = k*lap(u) + v
  dt(v) = k*lap(v) - u + w
  dt(w) = k*lap(w) - v
}
scheme c { lap = central(4); time = rk4 }
scene s : m with c {
  grid x = 0 .. 1, cells 32
  grid y = 0 .. 1, cells 32
  boundary u: all = 0
  boundary v: all = 0
  boundary w: all = 0
  initial u = sin(2*pi*x)
  initial v = x*y
  initial w = 1
  time 0 .. 1/40, step 1/4000
}
task t : s { unknown k from 0.1; minimise mean(u^2) at t = 1/40; using lbfgs(), iterations 3 }
)");
  const auto kept_after = [&](const std::string& iterations) {
    const Outcome run = process("optimize s.dpde t --json --iterations " + iterations);
    EXPECT_EQ(run.status, 0) << run.err;
    return std::ranges::count_if(fs::recursive_directory_iterator(path(".cache")),
                                 [](const fs::directory_entry& entry) { return entry.is_regular_file(); });
  };
  const auto after_one = kept_after("1");
  EXPECT_LE(kept_after("3"), after_one + 1) << "the first verdict may have been too quick to be kept";
}

/// Squares of values above 1e154 overflow, but the values are finite.
TEST_F(UnstableStep, ExactSolutionsMayBeLarge) {
  std::string text = plate("lap = central(2); time = rk4", "k*lap(u)", "0 .. 0.01, step 1/2000");
  text.insert(text.find("  time"), "  exact u = 1e200*exp(-2*pi^2*t)*sin(2*pi*x)\n");
  text.replace(text.find("initial u = sin"), 15, "initial u = 1e200*sin");
  write("s.dpde", text);
  const Outcome run = dpde("run s.dpde s --json");
  EXPECT_EQ(run.status, 0) << run.err;
  const Json error = run.json()["error"]["u"];
  EXPECT_LT(error["l2"].get<double>(), 1e199) << error;
  EXPECT_GT(error["l2"].get<double>(), 1e190) << error;
}

TEST_F(UnstableStep, StartsAndExactSolutionsThatAreNotFiniteAreTold) {
  const auto with = [&](const std::string& line) {
    std::string text = plate("lap = central(2); time = rk4", "k*lap(u)", "0 .. 0.01, step 1/2000");
    text.insert(text.find("  time"), line);
    write("s.dpde", text);
  };
  with("  exact u = sqrt(x - 2)\n");
  for (const std::string verb : {"check s.dpde s", "run s.dpde s", "chart s.dpde s"})
    EXPECT_EQ(dpde(verb + " --json").codes(), std::vector<std::string>{"E0812"}) << verb;
  std::string text = plate("lap = central(2); time = rk4", "k*lap(u)", "0 .. 0.01, step 1/2000");
  text.replace(text.find("initial u = sin(2*pi*x)"), 23, "initial u = sqrt(x - 2)");
  write("s.dpde", text);
  EXPECT_EQ(dpde("check s.dpde s --json").codes(), std::vector<std::string>{"E0805"});
}

TEST_F(UnstableStep, IsInTheVerdictOfCheck) {
  write("s.dpde", plate("lap = central(2); time = euler", "k*lap(u) + 0.1*u", "0 .. 1, step 1/128"));
  const Outcome check = dpde("check s.dpde s --json");
  EXPECT_EQ(check.status, 0) << check.err;
  const Json found = check.json()["stability"];
  EXPECT_NEAR(found["max_step"].get<double>(), 1.0 / 512, 1e-3 / 512);
  EXPECT_NEAR(found["mode"][0].get<double>(), 16 * M_PI, 0.1);  // two cells of 1/16
  EXPECT_EQ(found["exact"], true);
  EXPECT_EQ(found["stable"], false);
  EXPECT_EQ(found["term"]["text"], "k*lap(u)");
  EXPECT_NEAR(found["growth_rate"].get<double>(), 0.1, 1e-3);
}

/// Diffusion conserves the integral between insulated walls but not between cold ones; it never conserves squares.
/// Central differences in space conserve the square in advection, the RK4 step does not.
TEST_F(UnstableStep, ConservedSumsAreNamed) {
  const auto conserved = [&](const std::string& equation, const std::string& walls) {
    write("s.dpde", "model m { field u; dt(u) = " + equation + " }\nscheme c { advect = central(4); time = rk4 }\n" +
                        "scene s : m with c {\n  grid x = 0 .. 1, cells 64" + walls +
                        "\n  initial u = 1 + x\n  observe heat = 3*integral(u)\n  time 0 .. 1e-3, step 1e-4\n}\n");
    return dpde("check s.dpde s --json").json()["conserved"];
  };
  EXPECT_EQ(conserved("lap(u)", "\n  boundary u: x = zero_gradient"), (Json{"heat", "integral(u)"}));
  EXPECT_EQ(conserved("lap(u)", "\n  boundary u: x = 0"), Json::array());
  EXPECT_EQ(conserved("-advect(50, u)", ", periodic"), (Json{"heat", "integral(u)"}));
  EXPECT_EQ(conserved("-u*dx(u)", ", periodic"), (Json{"heat", "integral(u)"}));
  EXPECT_EQ(conserved("1 - u", ", periodic"), Json::array());
}

/// The scene has k = 0.5 and a stable step of 1/512; at the initial values of the task the limit is a third of that.
TEST_F(UnstableStep, OfWhereATaskBeginsIsRefused) {
  std::string text = plate("lap = central(2); time = euler", "k*lap(u)", "0 .. 1, step 1/512");
  text.replace(text.find("from 0.4"), 8, "from 1.5");
  write("s.dpde", text);
  EXPECT_TRUE(dpde("run s.dpde s --json").codes().empty());
  const Json stability = dpde("check s.dpde t --json").json()["stability"];
  EXPECT_NEAR(stability["max_step"].get<double>(), 1.0 / 512, 1e-3 / 512);
  EXPECT_NEAR(stability["max_step_where_task_begins"].get<double>(), 1.0 / 1536, 1e-3 / 1536);
  EXPECT_FALSE(dpde("check s.dpde s --json").json()["stability"].contains("max_step_where_task_begins"));
  for (const std::string verb : {"gradient s.dpde t", "optimize s.dpde t"}) {
    const Outcome run = dpde(verb + " --json");
    EXPECT_EQ(run.status, 2) << verb << run.err;
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0808"}) << verb << run.err;
    EXPECT_NE(run.err.find("0.000651"), std::string::npos) << run.err;  // 1/(3*512)
  }
  write("h.dpde",
        "model m { field u; param k; dt(u) = k*lap(u) }\nscheme c { time = euler }\nscene h : m with c {\n"
        "  grid x = 0 .. 1, cells 16, periodic\n  k = 0.01\n  initial u = sin(2*pi*x)\n  time 0 .. 10, step 0.05\n}\n"
        "task f : h {\n  unknown k from 0.03\n  minimise mean(u^2)\n}\n");
  const Outcome chart = dpde(
      "chart h.dpde h --task f --vary time=euler --vary cells=16 --vary fraction=0.9,0.3 --samples 1 --sample-seconds "
      "0 --json");
  ASSERT_EQ(chart.status, 0) << chart.err;
  const Json points = chart.json()["points"];
  ASSERT_EQ(points.size(), 2u);
  EXPECT_NE(points[0]["gradient_failure"].get<std::string>().find("where the task begins"), std::string::npos);
  EXPECT_TRUE(points[1]["gradient_failure"].is_null()) << "0.3 times the limit at k = 0.01, 0.9 times that at 0.03";
}

/// u = 0 has no limit, but u = 1, to which the run goes, has one of 2.785/530: the report names states that the verdict
/// does not cover.
TEST_F(UnstableStep, WhatStatesGrowToIsSaidToBeLeftOut) {
  const auto said = [&](const std::string& initial) {
    write("g.dpde",
          "model m { field u; dt(u) = 300*tanh(u) - 300*u^3 }\n"
          "scene s : m {\n  grid x = 0 .. 1, cells 24, periodic\n  initial u = " +
              initial + "\n  time 0 .. 0.1, step 1e-4\n}\n");
    return dpde("check g.dpde --all").out;
  };
  const std::string grows = said("0.01*sin(2*pi*x)"), rests = said("1");
  EXPECT_NE(grows.find("no step was found that is too large for it as it begins\n  what its states grow to may"),
            std::string::npos)
      << grows;
  EXPECT_NE(rests.find("stable up to a step of"), std::string::npos) << rests;
}

}  // namespace
}  // namespace dpde::testing
