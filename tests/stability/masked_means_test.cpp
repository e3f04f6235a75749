// SPDX-License-Identifier: Apache-2.0
// Fields prescribed by means of the whole grid, inside masks that are fixed or move. Outside of the mask the mean has
// no effect, so the grid must not be treated as if the mask covered it. Limits are compared with runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "stability/stability_report.h"
#include "stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// `mask` may read s, which goes from 0 to 1 in the run.
struct HeldMean {
  std::string held, mask, time;
  int cells;
};

std::string text_of(const HeldMean& scene) {
  const double step = 4.0 / (scene.cells * scene.cells), end = 400 * step;
  return fmt::format(
      "model m {{ field u; mask q; dt(u) = 0.05*lap(u) + 0.001; u = {} inside q }}\nscheme p {{ time = {} }}\n"
      "scene s : m with p {{ grid x = 0 .. 1, cells {}\n let s = t/{}\n q = {}\n boundary u: x = zero_gradient\n"
      " initial u = 1; time 0 .. {}, step {} }}\n",
      scene.held, scene.time, scene.cells, end, scene.mask, end, step);
}

bool grows_in_run(const std::string& text) {
  const auto session = open_scene(text);
  session->rollout().run();
  const std::vector<double> last = session->final_state(0);
  return !std::ranges::all_of(last, [](double value) { return std::abs(value) < 100; });
}

TEST(MaskedMeans, HaveTheVerdictOfRuns) {
  std::size_t count = 0;
  for (const char* mask : {"abs(x - 0.5 - 0.3*sin(9*s)) < 0.1", "abs(x - 0.5) < 0.1", "x < 0.2 + 0.1*sin(9*s)",
                           "abs(x - 0.3) < 0.1 or x > 0.9 - 0.1*s"}) {
    for (const char* held : {"-0.9*mean(u)", "-2*mean(u)", "0.5*mean(u)", "-12*mean(u)", "12*mean(u)", "-mean(u)^3"}) {
      for (const char* time : {"rk4", "rk2", "euler"}) {
        for (const int cells : {12, 300}) {
          if (!testing::is_tried(count++, 17)) continue;
          const std::string text = text_of({held, mask, time, cells});
          const bool is_never = verdict_of(*open_scene(text)).limit.kind == StepLimit::Kind::never;
          EXPECT_EQ(is_never, grows_in_run(text)) << text;
        }
      }
    }
  }
}

/// A mean that adds the same everywhere is a wave as before.
TEST(MaskedMeans, OfAllPlacesAlikeAreWaves) {
  const StabilityReport verdict = verdict_of(*open_scene(
      "model m { field u; coefficient c; dt(u) = c*lap(u) - 500*mean(u) }\nscheme p { time = euler }\n"
      "scene s : m with p { grid x = 0 .. 1, cells 300, periodic\n c = 1e-6*(2 + sin(2*pi*x))\n initial u = 1\n"
      " time 0 .. 1, step 1/1000 }\n"));
  EXPECT_FALSE(verdict.is_of_runs());
  EXPECT_NEAR(verdict.limit.step, 2.0 / 500, 1e-3 * 2 / 500);
}

}  // namespace
}  // namespace dpde::stability
