// SPDX-License-Identifier: Apache-2.0
// Largest stable steps, against limits from a scan of amplification factors (numerics.md, 1.1 and 1.2): slightly below
// them nothing grows, slightly above something does. Combinations without a stable step grow at the rate of their
// amplification factor.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;

constexpr int cells = 200;
constexpr double spacing = 1.0 / cells;
constexpr double margin = 0.01;
const std::string noise = "fraction(43758.5453*sin(x*78233 + 1)) - 0.5";  // all modes of the grid

std::string line(const std::string& rate, const std::string& scheme, const std::string& initial) {
  return "model m { field u; dt(u) = " + rate + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n" +
         "  grid x = 0 .. 1, cells 200, periodic\n  initial u = " + initial + "\n  time 0 .. 1, step 1\n}\n";
}

double largest(const std::vector<double>& values) {
  double result = 0;
  for (const double v : values) result = std::isfinite(v) ? std::max(result, std::abs(v)) : INFINITY;
  return result;
}

/// Largest |u| after this number of steps relative to the start.
double growth(const std::string& text, double step, int steps) {
  const auto at = [&](int n) {
    const auto state =
        run_scene(text, "s", {{"step", fmt::format("{}", step)}, {"end", fmt::format("{}", n * step)}}).state;
    return state.contains("u") ? largest(state.at("u")) : 0.0;
  };
  return at(steps) / at(1);
}

struct Limit {
  std::string space, time;
  double courant;         // or diffusion number
  double above = margin;  // margin with visible growth: upwind(3) with rk2 grows by only 6e-6 a step at 1 per cent
};

std::ostream& operator<<(std::ostream& out, const Limit& limit) { return out << limit.space << " " << limit.time; }

/// `unit` is the step of Courant number 1; `key` the scheme's line for space.
void expect_limit(const Limit& limit, const std::string& rate, const std::string& key, double unit) {
  const std::string text = line(rate, key + " = " + limit.space + "; time = " + limit.time, noise);
  const double step = limit.courant * unit;
  EXPECT_LT(growth(text, step * (1 - margin), 2000), 3);
  EXPECT_GT(growth(text, step * (1 + limit.above), 2000), 1e3);
}

class AdvectionLimit : public ::testing::TestWithParam<Limit> {};

TEST_P(AdvectionLimit, IsThatOfVonNeumann) { expect_limit(GetParam(), "-advect(1, u)", "advect", spacing); }

INSTANTIATE_TEST_SUITE_P(Numeric, AdvectionLimit,
                         ::testing::Values(Limit{"upwind(1)", "euler", 1.0}, Limit{"upwind(1)", "rk2", 1.0},
                                           Limit{"upwind(1)", "ssp_rk3", 1.2564}, Limit{"upwind(1)", "rk4", 1.3926},
                                           Limit{"upwind(1)", "ab2", 0.5}, Limit{"central(2)", "ssp_rk3", 1.7321},
                                           Limit{"central(2)", "rk4", 2.8284}, Limit{"central(2)", "leapfrog", 1.0},
                                           Limit{"central(4)", "ssp_rk3", 1.2622}, Limit{"central(4)", "rk4", 2.0612},
                                           Limit{"central(4)", "leapfrog", 0.7288},
                                           Limit{"upwind(3)", "rk2", 0.8738, 0.12},
                                           Limit{"upwind(3)", "ssp_rk3", 1.6259}, Limit{"upwind(3)", "rk4", 1.7453},
                                           Limit{"upwind(3)", "ab2", 0.5802}));

class DiffusionLimit : public ::testing::TestWithParam<Limit> {};

TEST_P(DiffusionLimit, IsThatOfVonNeumann) { expect_limit(GetParam(), "lap(u)", "lap", spacing * spacing); }

INSTANTIATE_TEST_SUITE_P(Numeric, DiffusionLimit,
                         ::testing::Values(Limit{"central(2)", "euler", 0.5}, Limit{"central(2)", "rk2", 0.5},
                                           Limit{"central(2)", "ssp_rk3", 0.62819}, Limit{"central(2)", "rk4", 0.69632},
                                           Limit{"central(2)", "ab2", 0.25}, Limit{"central(4)", "euler", 0.375},
                                           Limit{"central(4)", "rk2", 0.375}, Limit{"central(4)", "ssp_rk3", 0.47114},
                                           Limit{"central(4)", "rk4", 0.52224}, Limit{"central(4)", "ab2", 0.1875}));

/// A mode of phase angle pi/2 and its growth per step in cases without a stable step.
TEST(NoLimit, ModesGrowAsTheirAmplificationFactorSays) {
  const std::string mode = "sin(2*pi*50*x)";
  const auto factor = [&](const std::string& scheme, double courant, int steps) {
    return std::pow(growth(line("-advect(1, u)", scheme, mode), courant * spacing, steps + 1), 1.0 / steps);
  };
  // largest value of a travelling mode varies with its phase: less than 1 per cent over so many steps
  EXPECT_NEAR(factor("advect = central(2); time = euler", 0.5, 200), std::sqrt(1 + 0.25), 0.005);
  EXPECT_NEAR(factor("advect = central(2); time = rk2", 0.5, 594), std::pow(1 + std::pow(0.5, 4) / 4, 0.5), 0.0015);
  EXPECT_NEAR(factor("advect = central(2); time = rk2", 1.0, 42), std::pow(1 + 0.25, 0.5), 0.02);
  EXPECT_GT(growth(line("-advect(1, u)", "advect = upwind(1); time = leapfrog", noise), 0.1 * spacing, 1000), 1e3);
  EXPECT_GT(growth(line("-advect(1, u)", "advect = upwind(3); time = leapfrog", noise), 0.1 * spacing, 1000), 1e3);
  EXPECT_GT(growth(line("lap(u)", "time = leapfrog", noise), 0.05 * spacing * spacing, 1000), 1e3);
}

}  // namespace
}  // namespace dpde
