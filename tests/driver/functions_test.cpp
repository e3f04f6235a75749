// SPDX-License-Identifier: Apache-2.0
// Functions of formulas as scenes and tasks have them: values, gradients, and jumps that gradients refuse.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "driver/driver_support.h"
#include "driver/watched_support.h"
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

/// The gradient of task t by its unknown numbers.
Eigen::VectorXd gradient_by_numbers(const std::string& text) {
  const auto task = open_task(SourceFile("circle.dpde", text), true, driver::Backend::interpreter);
  if (!task) return {};
  Eigen::VectorXd gradient(task->inverse->size());
  task->inverse->value_and_gradient(task->inverse->start(), gradient);
  return gradient;
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

/// sin(theta) and cos(theta) by y and x, where quotients of y and x or their slopes are largest: on the axes, and with
/// sizes far apart. Without a grid a step by Euler adds them once.
TEST(Functions, SlopesOfAnglesAreThoseOfTheCircle) {
  const std::pair<double, double> points[] = {{0, -1},      {0, 1},        {1, 0},      {-1, 0},
                                              {1e-170, -1}, {-1e-170, -1}, {1, 1e-170}, {1, -1e-170},
                                              {1e170, -1},  {-1, 1e170},   {0.3, -0.4}, {-0.4, 0.3}};
  for (const auto& [y, x] : points) {
    const auto gradient_of_end = [&](const char* function) {
      return gradient_by_numbers(fmt::format(
          "model m {{ field s; param b = {}, a = {}; dt(s) = {}(atan2(b, a)) }}\nscheme e {{ time = euler }}\n"
          "scene a : m with e {{ initial s = 0; time 0 .. 1, step 1 }}\n"
          "task t : a {{ unknown b; unknown a; minimise mean(s) at t = 1 }}\n",
          y, x, function));
    };
    const double r = std::hypot(y, x), by = y / r, bx = x / r;
    const Eigen::VectorXd of_sine = gradient_of_end("sin"), of_cosine = gradient_of_end("cos");
    ASSERT_EQ(of_sine.size(), 2);
    ASSERT_EQ(of_cosine.size(), 2);
    SCOPED_TRACE(fmt::format("y = {}, x = {}", y, x));
    EXPECT_NEAR(of_sine[0], bx * (bx / r), 1e-14 / r);
    EXPECT_NEAR(of_sine[1], -by * (bx / r), 1e-14 / r);
    EXPECT_NEAR(of_cosine[0], -bx * (by / r), 1e-14 / r);
    EXPECT_NEAR(of_cosine[1], by * (by / r), 1e-14 / r);
  }
}

/// The angle jumps across the negative x axis, its sine does not.
TEST(Functions, AnglesJumpWhereNothingHidesIt) { EXPECT_EQ(code_refused(task_of("a*atan2(v, u - 0.6)")), "E0609"); }

}  // namespace
}  // namespace dpde::testing
