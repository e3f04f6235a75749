// SPDX-License-Identifier: Apache-2.0
// The other time scheme that is suggested if every step is unstable: its largest step is that of its own verdict, also
// with walls and prescribed values.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

struct NeverStable {
  std::string name, model, scene;
};

std::string text_of(const NeverStable& problem, const std::string& time) {
  return fmt::format(
      "model m {{ {} }}\nscheme r {{ time = {} }}\nscene s : m with r {{\n{}\n  time 0 .. 1, step 1/1000\n}}\n",
      problem.model, time, problem.scene);
}

TEST(OtherScheme, IsNamedWithItsOwnVerdict) {
  const NeverStable all[] = {
      {"ring", "field u; dt(u) = -dx(u)", "grid x = 0 .. 1, cells 40, periodic\n initial u = 1"},
      {"what comes back from a wall", "field u; dt(u) = -dx(u)",
       "grid x = 0 .. 1, cells 40\n boundary u: x.low = 0, x.high = 3*u\n initial u = 0.5"},
      {"frozen walls", "field u, v; dt(u) = dx(v); dt(v) = dx(u)",
       "grid x = 0 .. 1, cells 700\n boundary u: x = zero_gradient\n boundary v: x = 0\n initial u = 0.5\n"
       " initial v = 0"},
      {"a held value", "field u; mask q; dt(u) = 0; u = 1.02*u inside q",
       "grid x = 0 .. 1, cells 600, periodic\n q = abs(x - 0.5) < 0.2\n initial u = 1"},
      {"a held value beside a wind", "field u; mask q; dt(u) = -dx(u); u = 1.02*u inside q",
       "grid x = 0 .. 1, cells 40, periodic\n q = abs(x - 0.5) < 0.2\n initial u = 1"},
  };
  int named = 0;
  for (const NeverStable& problem : all) {
    const auto euler = open_scene(text_of(problem, "euler"));
    ASSERT_EQ(verdict_of(*euler).limit.kind, StepLimit::Kind::never) << problem.name;
    const std::optional<OtherScheme> other = stable_scheme(*euler);
    for (const char* time : {"ssp_rk3", "rk4"}) {
      const StepLimit limit = verdict_of(*open_scene(text_of(problem, time))).limit;
      const bool is_named = other && other->time == time;
      EXPECT_EQ(limit.kind == StepLimit::Kind::limit, is_named) << problem.name << " " << time;
      if (!is_named) continue;
      EXPECT_NEAR(other->step, limit.step, 2e-3 * limit.step) << problem.name;
      break;  // the first one that has a limit is named
    }
    named += other ? 1 : 0;
  }
  EXPECT_EQ(named, 3);
}

}  // namespace
}  // namespace dpde::stability
