// SPDX-License-Identifier: Apache-2.0
// Sources of errors: for known solutions the parts from cells, steps, rounding and solves add up to the measured error
// within a factor of 1.5.
#include <cmath>

#include "chart_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class ChartBudget : public ChartCommand {
 protected:
  static void expect_that_it_adds_up(const Json& point) {
    ASSERT_TRUE(point["budget"]["failure"].is_null()) << point;
    const double ratio = point["budget"]["sum"].get<double>() / point["error"].get<double>();
    EXPECT_GT(ratio, 1 / 1.5) << point;
    EXPECT_LT(ratio, 1.5) << point;
    EXPECT_EQ(point["budget"]["rounding"].is_null(), point["variant"].value<std::string>("real", "f64") == "f64");
  }
};

/// Linear and limited schemes, of order 1 to 6 in space and 1 to 4 in time, also implicit, in one and two dimensions.
/// For the drum only u is measured: its velocity has no exact solution.
TEST_F(ChartBudget, AddsUpToTheErrorOfExactSolutions) {
  if (!is_thorough()) GTEST_SKIP() << "at night: eleven seconds";
  struct Case {
    const char* chart;
    std::size_t points;  // number of stable points
  };
  const Case cases[] = {
      {"advection/advection.dpde ring --vary advect=upwind1,central6,weno5 --vary time=rk4 "
       "--vary cells=32,64 --vary fraction=0.9",
       6},
      {"heat/heat.dpde rod --vary time=rk4,crank_nicolson --vary cells=32 --vary fraction=0.9,0.3 --vary real=f32,f64",
       8},
      {"heat/heat.dpde plate --vary lap=central2,central4 --vary time=euler,rk4 --vary cells=16 "
       "--vary fraction=0.9",
       4},
      {"burgers_1d/burgers.dpde accuracy_of_front --vary cells=32,64 --vary fraction=0.9 --vary time=euler,rk4", 12},
      {"wave/wave.dpde drum --vary lap=central2,central4 --vary time=verlet,leapfrog,rk4 --vary cells=16 "
       "--vary fraction=0.5",
       6}};
  for (const Case& one : cases) {
    if (&one == cases + 3 && !is_thorough()) break;
    const Outcome run = dpde(std::string("chart " DPDE_SOURCE_DIR "/dsl-examples/") + one.chart + " --budget" + quick);
    ASSERT_EQ(run.status, 0) << run.err;
    std::size_t stable = 0;
    const Json json = run.json();
    for (const Json& point : json["points"]) {
      if (!point["failure"].is_null()) continue;
      ++stable;
      expect_that_it_adds_up(point);
    }
    EXPECT_EQ(stable, one.points) << one.chart;
  }
}

/// A flow with a closed form (Taylor and Green 1937) whose pressure is solved iteratively: tolerances are points of one
/// curve, and the error of a loose one is a part of the budget.
TEST_F(ChartBudget, TolerancesOfSolvesAreAnAxis) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("s.dpde",
        "model flow { vector u on faces; field p; param nu\n  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)\n"
        "  0 = div(u) gives p }\nscheme plain { time = rk4; solve = cg(1e-1) }\nscene s : flow with plain {\n"
        "  grid x = 0 .. 2*pi, cells 16, periodic\n  grid y = 0 .. 2*pi, cells 16, periodic\n  nu = 0.01\n"
        "  initial u = (sin(x)*cos(y), -cos(x)*sin(y))\n"
        "  exact u = (sin(x)*cos(y)*exp(-2*nu*t), -cos(x)*sin(y)*exp(-2*nu*t))\n  time 0 .. 1, step 0.25\n}\n"
        "chart solves : s {\n  vary solve in cg(1e-1), cg(1e-8), multigrid(1e-1)\n  vary step in 1/4\n"
        "  vary cells in 16\n  error l2(u.x)\n}\n");
  const Json json = dpde("chart s.dpde solves --budget --out o" + quick).json();
  ASSERT_EQ(json["points"].size(), 3u) << json;
  EXPECT_EQ(json["methods"].size(), 2u) << "cg and multigrid";
  const Json &loose = json["points"][0], &exact = json["points"][1];
  EXPECT_EQ(loose["variant"]["solve"], "cg(1e-1)");
  EXPECT_GT(loose["error"].get<double>(), 1.2 * exact["error"].get<double>());
  EXPECT_EQ(loose["budget"]["largest"], "solves");
  EXPECT_EQ(exact["budget"]["largest"], "space");
  EXPECT_LT(exact["budget"]["solves"].get<double>(), 1e-6);
  for (const Json& point : json["points"]) expect_that_it_adds_up(point);
  EXPECT_NE(content(path("o/solves.csv")).find("solve=cg,16x16,0.25,4,cg(1e-8),"), std::string::npos);
  // The reference is solved more accurately than the scene.
  const Json self = dpde("chart s.dpde solves --reference-cells 64 --vary 'solve=cg(1e-8)'" + quick).json();
  EXPECT_NEAR(self["points"][0]["error"].get<double>(), exact["error"].get<double>(),
              0.05 * exact["error"].get<double>());
}

}  // namespace
}  // namespace dpde::testing
