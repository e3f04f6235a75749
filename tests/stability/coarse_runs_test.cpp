// SPDX-License-Identifier: Apache-2.0
// What runs of a verdict take is counted in values that steps make, before any is made.
#include "stability/coarse_runs.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "stability/equations.h"
#include "stability/frozen_points.h"
#include "stability/stability_support.h"
#include "stability/verdict.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

std::string in_box(const std::string& model, const std::string& scheme, int cells, const std::string& initial) {
  return fmt::format(
      "model m {{ {} }}\nscheme c {{ {} }}\nscene s : m with c {{\n  grid x = 0 .. 2*pi, cells {}, periodic\n"
      "  grid y = 0 .. 2*pi, cells {}, periodic\n  initial {}\n  time 0 .. 1e-2, step 1e-3\n}}\n",
      model, scheme, cells, cells, initial);
}

const std::string burgers = "field u; dt(u) = -u*dx(u) + 1e-3*lap(u)",
                  cahn_hilliard = "field u; dt(u) = lap(u^3 - u) - 0.01*lap(lap(u))",
                  vortices = "field w; solve lap(psi) = w for psi; dt(w) = -bracket(psi, w)",
                  series = "dx = spectral; lap = spectral; time = ", sines = "u = sin(x)*cos(y)",
                  flow = "w = -5*cos(x + 2*y) + 1e-8*noise(1)";

const std::string sphere =
    "model m { field u; dt(u) = lap(u) }\nscheme c { time = rk4 }\nscene s : m with c {\n  coordinates sphere(1)\n"
    "  grid lon = 0 .. 2*pi, cells 32, periodic\n  grid lat = -pi/2 .. pi/2, cells 16\n  boundary u: lat = pole\n"
    "  initial u = sin(lat)\n  time 0 .. 1e-3, step 1e-4\n}\n";

struct Runs {
  std::unique_ptr<driver::Session> session;
  std::optional<LinearStep> linear;
  std::unique_ptr<CoarseRuns> coarse;
  double cells() const { return static_cast<double>(session->workspace().cell_count()); }
};

Runs runs_of(const std::string& text) {
  Runs result{open_scene(text), {}, nullptr};
  std::string why;
  result.linear = linear_step(*result.session, why);
  EXPECT_TRUE(result.linear) << why;
  const std::vector<ScenePoint> points = frozen_points(*result.session, *result.linear);
  result.coarse = CoarseRuns::make(*result.session, *result.linear, points.front().point);
  return result;
}

TEST(CoarseRuns, WorkIsWithinTheBudget) {
  struct Case {
    const char* name;
    std::string text;
    bool is_coarse;
  };
  for (const Case& c : {Case{"Fourier series", in_box(burgers, series + "rk4", 128, sines), true},
                        {"exponential", in_box(cahn_hilliard, series + "etdrk4", 64, sines), true},
                        {"a solve", in_box(vortices, series + "rk4", 16, flow), false},
                        {"a sphere", sphere, false}}) {
    const Runs runs = runs_of(c.text);
    ASSERT_EQ(runs.coarse != nullptr, c.is_coarse) << c.name;
    const double cells = runs.coarse ? runs.coarse->cells() : runs.cells();
    if (runs.coarse) {
      EXPECT_LT(cells, runs.cells()) << c.name;
      EXPECT_GE(4 * cells * CoarseRuns::steps_of_search * values_a_cell(*runs.linear), CoarseRuns::most_values)
          << c.name << ": no coarser than they have to be";
    }
    EXPECT_LE(cells * CoarseRuns::steps_of_search * values_a_cell(*runs.linear), CoarseRuns::most_values) << c.name;
  }
}

/// On 64 cells a side, as runs on these have it (by the release before budgets).
TEST(CoarseRuns, TakeLimitsOnToTheScenesCells) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: a verdict by runs";
  const auto session = open_scene(in_box(vortices, series + "rk4", 64, flow));
  const Verdict verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_FALSE(verdict.is_of_runs);
  EXPECT_TRUE(verdict.is_of_means);
}

}  // namespace
}  // namespace dpde::stability
