// SPDX-License-Identifier: Apache-2.0
// Functions of formulas as scenes and tasks have them: values, gradients, and jumps that gradients refuse.
#include <gtest/gtest.h>

#include <cmath>

#include "driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// On all sides of the origin, on both axes and at the origin itself.
TEST(Functions, AnglesAreThoseOfTheCLibrary) {
  const std::string text =
      "model m { field u; dt(u) = atan2(y, x) }\nscene s : m {\n  grid x = -1 .. 1, cells 7, periodic\n"
      "  grid y = -1 .. 1, cells 5, periodic\n  initial u = 0\n  time 0 .. 1, step 1\n}\nscheme c { time = euler }\n";
  for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    const SceneResult result = run_scene(text, "s", {{"time", "euler"}}, backend);
    ASSERT_EQ(result.state.at("u").size(), 35u);
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 7; ++i) {
        const double x = i == 3 ? 0 : -1 + (i + 0.5) * 2 / 7, y = j == 2 ? 0 : -1 + (j + 0.5) * 2 / 5;
        EXPECT_NEAR(result.state.at("u")[static_cast<std::size_t>(7 * j + i)], std::atan2(y, x), 1e-15)
            << x << " " << y;
      }
    }
  }
}

std::string task_of(const std::string& rate) {
  return "model m { field u, v; param a = 0.4; dt(u) = -u + " + rate +
         "; dt(v) = -0.3*u }\nscene s : m {\n  grid x = 0 .. 8, cells 7, periodic\n"
         "  initial u = 0.6 + 0.3*sin(pi*x/4); initial v = 0.5*cos(pi*x/4)\n  time 0 .. 0.5, step 1/16\n}\n"
         "task t : s { unknown a; unknown initial u; minimise mean(u^2) + mean(v^3) }\n";
}

TEST(Functions, HaveGradients) {
  for (const char* rate : {"a*erf(u - a*v)", "erf(erf(3*u)*v/a)", "sin(atan2(a*v, u))", "cos(2*atan2(u, v + a))"}) {
    SCOPED_TRACE(rate);
    expect_certified(task_of(rate), true);
  }
}

/// The angle jumps across the negative x axis, its sine does not.
TEST(Functions, AnglesJumpWhereNothingHidesIt) { EXPECT_EQ(code_refused(task_of("a*atan2(v, u - 0.6)")), "E0609"); }

}  // namespace
}  // namespace dpde::testing
