// SPDX-License-Identifier: Apache-2.0
// Largest stable steps of schemes whose weights depend on the field: an estimate, and where limiters hold what grows.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

std::unique_ptr<driver::Session> session_of(const std::string& advect, const std::string& time, double step = 0.1,
                                            int steps = 100) {
  return open_scene(
      fmt::format("model m {{ field u; dt(u) = -advect(1, u) }}\n"
                  "scheme c {{ advect = {}; time = {} }}\nscene s : m with c {{\n"
                  "  grid x = 0 .. 64, cells 64, periodic\n"
                  "  initial u = sin(2*pi*x/64)\n  time 0 .. {}, step {}\n}}\n",
                  advect, time, steps * step, step));
}

/// Where the state is frozen the weights of weno are linear; limiters leave upwind(1) of a constant, Fromm's scheme of
/// a slope. None of that is exact.
TEST(UpwindLimit, OfWeightsAndLimitersIsAnEstimate) {
  for (const std::string advect : {"weno(3)", "weno(5)", "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"}) {
    for (const std::string time : {"ssp_rk3", "rk4"}) {
      const std::unique_ptr<driver::Session> session = session_of(advect, time);
      const StabilityReport verdict = verdict_of(*session);
      ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << advect << time;
      EXPECT_FALSE(verdict.is_exact) << advect;
      EXPECT_GT(verdict.limit.step, advect[0] == 'm' ? 0.6 : 1.3) << advect << time;
      EXPECT_LT(verdict.limit.step, 1.8) << advect << time;
    }
  }
}

/// Of a slope muscl is Fromm's scheme, which grows by Euler's method at every step. Limiters hold that up to the
/// Courant number 1/(1 + L/2), L being the steepest slope they take (Harten, Sweby), and no further: runs show both.
TEST(UpwindLimit, OfLimitersByEulersMethodIsWhereTheyKeepTheRange) {
  const Difference fromm{-2, {1, -5, 3, 1}, 4};
  const std::map<std::string, double> bounds{
      {"muscl(minmod)", 2.0 / 3}, {"muscl(van_leer)", 1.0 / 2}, {"muscl(mc)", 1.0 / 2}};
  for (const auto& [advect, bound] : bounds) {
    const StabilityReport verdict = verdict_of(*session_of(advect, "euler", 0.4));
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never) << advect;
    double growth = 0;
    for (int i = 0; i <= 4000; ++i)
      growth = std::max(growth, std::abs(1.0 - 0.4 * fromm.of(std::numbers::pi * i / 4000)));
    EXPECT_NEAR(verdict.growth, growth, 1e-6) << advect;
    EXPECT_NEAR(verdict.limiter_step, bound, 1e-6) << advect;
    EXPECT_TRUE(verdict.is_above());
    EXPECT_FALSE(verdict.ruins_run()) << advect;
    EXPECT_TRUE(verdict_of(*session_of(advect, "euler", 1.05 * bound)).ruins_run()) << advect;
    const auto largest_behind = [&](double step) {
      const std::unique_ptr<driver::Session> session = session_of(advect, "euler", step, 4000);
      session->rollout().run();
      double largest = 0;
      for (const double u : session->final_state(0)) largest = std::max(largest, std::abs(u));
      return largest;
    };
    EXPECT_LE(largest_behind(bound), 1 + 1e-12) << advect;
    EXPECT_GT(largest_behind(1.2 * bound), 10) << advect;
  }
}

}  // namespace
}  // namespace dpde::stability
