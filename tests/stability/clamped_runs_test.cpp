// SPDX-License-Identifier: Apache-2.0
// Clamped steps in curved coordinates: solid rotation in an annulus has no limit, for any boundary conditions.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

std::unique_ptr<driver::Session> annulus(const std::string& wall, double step) {
  return open_scene(
      fmt::format("model c {{ field q; coefficient vector w; dt(q) = -advect(w, q) }}\n"
                  "scheme mc {{ advect = maccormack; time = rk2 }}\nscene s : c with mc {{ coordinates polar\n"
                  "  grid r = 1 .. 2, cells 8; grid theta = 0 .. 2*pi, cells 32, periodic\n"
                  "  w = (0, r); boundary q: r = {}\n"
                  "  initial q = exp(-20*((r*cos(theta) - 1.5)^2 + (r*sin(theta))^2)); time 0 .. 200*{}, step {} }}\n",
                  wall, step, step));
}

TEST(ClampedRuns, InAnAnnulusHaveNoLimit) {
  std::vector<std::string> walls{"linear"};
  if (testing::is_thorough()) walls.emplace_back("zero_gradient");
  for (const std::string& wall : walls) {
    const StabilityReport verdict = verdict_of(*annulus(wall, 0.01));
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::none) << wall;
    for (const double step : {0.01, 0.2, 0.7}) {
      const auto session = annulus(wall, step);
      EXPECT_TRUE(grows_nothing(*session)) << wall << step;
      session->rollout().run();
      std::vector<double> values(session->workspace().cell_count());
      copy_out(session->workspace().layout(), session->rollout().final_states()[0], values);
      for (const double value : values) EXPECT_LT(std::abs(value), 1.01) << wall << step;
    }
  }
}

}  // namespace
}  // namespace dpde::stability
