// SPDX-License-Identifier: Apache-2.0
// Reports on a step with stored inner differences are those on its equations.
#include "command_support.h"

namespace dpde::testing {
namespace {

using NestedDifferences = Command;

/// The growth rates equal those from before values were stored.
TEST_F(NestedDifferences, AreJudgedByTheirEquations) {
  write("t.dpde",
        "model m { field u; dt(u) = -0.1*dx(u^2*dy(u*dx(u))) }\nscheme q { time = euler; dx = central(6) }\n"
        "scene s : m with q { grid x = 0 .. 3.4, cells 10, periodic\ngrid y = 0 .. 4.1, cells 24, periodic\n"
        "initial u = 1.3 + 0.3*sin(2*pi*x/3.4) + 0.3*cos(2*pi*y/4.1); time 0 .. 1e-3, step 1e-4 }\n");
  const Outcome outcome = dpde("check t.dpde s --json --set cells.x=24");
  const auto stability = outcome.json()["stability"];
  EXPECT_NEAR(stability["growth_rate"].get<double>(), 59.7438, 1e-3) << outcome.out;
  EXPECT_EQ(stability["ill_posed"]["order"], 2) << outcome.out;
  const Outcome narrow = dpde("check t.dpde --all s");
  EXPECT_NE(narrow.err.find("t.dpde:1:20: warning[W0505]: a step reads 11 cells in a row along x, which has 10"),
            std::string::npos)
      << narrow.err;
}

}  // namespace
}  // namespace dpde::testing
