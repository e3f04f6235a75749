// SPDX-License-Identifier: Apache-2.0
// Cell numbers, positivity and waves of a frozen step, against closed forms and section 1 of the table of references.
#include "stability/report/local_character.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <complex>
#include <numbers>

#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

using std::numbers::pi;

/// On 32 cells of width 1.
std::unique_ptr<driver::Session> line(const std::string& rate, const std::string& scheme, double step) {
  return open_scene("model m { field u; dt(u) = " + rate + " }\nscheme c { " + scheme +
                    " }\nscene s : m with c {\n  grid x = 0 .. 32, cells 32, periodic\n  initial u = sin(2*pi*x/32)\n" +
                    fmt::format("  time 0 .. {}, step {}\n}}\n", 10 * step, step));
}

std::unique_ptr<driver::Session> burgers(const std::string& advect, int cells) {
  return open_scene(
      "model m { field u; dt(u) = -advect(u, u) + 0.01/pi*lap(u) }\nscheme c { time = rk4; advect = " + advect +
      fmt::format(" }}\nscene s : m with c {{\n  grid x = -1 .. 1, cells {}, periodic\n", cells) +
      "  initial u = -sin(pi*x)\n  time 0 .. 0.1, step 1e-3\n}\n");
}

/// |u| is largest half a cell from x = -1/2, where a cell has the number |u|*h/nu.
TEST(CellNumber, OfBurgersOn64CellsRingsWithCentralDifferences) {
  const double h = 2.0 / 64, expected = std::cos(pi * h / 2) * h / (0.01 / pi);
  for (const auto& [advect, rings] : {std::pair("central(2)", true),
                                      {"central(4)", true},
                                      {"upwind(1)", false},
                                      {"upwind(3)", false},
                                      {"semi_lagrangian", false}}) {
    const std::vector<CellNumber> found = cell_numbers(*burgers(advect, 64));
    ASSERT_EQ(found.size(), 1u) << advect;
    EXPECT_NEAR(found[0].number, expected, 1e-9 * expected) << advect;
    EXPECT_NEAR(found[0].diffusion, 0.01 / pi, 1e-12) << advect;
    EXPECT_TRUE(found[0].is_reynolds) << advect;
    EXPECT_EQ(found[0].rings, rings) << advect;
  }
  EXPECT_FALSE(cell_numbers(*burgers("central(2)", 512))[0].rings);
}

TEST(CellNumber, IsOneAnAxisAndFollowsCoefficients) {
  const auto session = open_scene(
      "model m { field c; dt(c) = -advect((2 + sin(2*pi*y), 0.5), c) + div(0.1*grad(c)) }\nscene s : m {\n"
      "  grid x = 0 .. 8, cells 16, periodic\n  grid y = 0 .. 1, cells 32, periodic\n  initial c = x\n"
      "  time 0 .. 1e-3, step 1e-4\n}\n");
  const std::vector<CellNumber> found = cell_numbers(*session);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].axis, 0);
  EXPECT_NEAR(found[0].number, (2 + std::cos(pi / 32)) * 0.5 / 0.1, 1e-9);
  EXPECT_FALSE(found[0].is_reynolds);
  EXPECT_NEAR(found[1].number, 0.5 / 32 / 0.1, 1e-9);
  EXPECT_FALSE(found[1].rings);
}

TEST(CellNumber, IsInfiniteWithoutDiffusionAndNoneWithoutTransport) {
  const std::vector<CellNumber> found = cell_numbers(*line("-advect(1, u)", "advect = central(2)", 0.1));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(std::isinf(found[0].number));
  EXPECT_FALSE(found[0].rings) << "nothing limits it: every wave is carried";
  EXPECT_TRUE(cell_numbers(*line("lap(u) - u", "time = euler", 0.1)).empty());
}

/// The step at which a weight first becomes 0.
TEST(Positivity, LimitsAreThoseOfClosedForms) {
  const double infinite = std::numeric_limits<double>::infinity();
  struct Case {
    std::string rate, scheme;
    double limit;
  };
  const Case cases[] = {
      {"lap(u)", "time = euler", 0.5},                           // 1 - 2r
      {"lap(u)", "time = rk2", 0.5},                             // r - 2r^2
      {"-advect(1, u)", "time = euler; advect = upwind(1)", 1},  // 1 - C
      {"-advect(1, u) + lap(u)", "time = euler; advect = upwind(1)", 1.0 / 3},
      {"-advect(1, u) + lap(u)", "time = euler; advect = central(2)", 0.5},  // r >= C/2
      {"-advect(4, u) + lap(u)", "time = euler; advect = central(2)", 0},    // r < C/2: cell number 4
      {"-advect(1, u)", "time = rk4; advect = upwind(3)", 0},
      {"lap(u)", "time = euler; lap = central(4)", 0},
      {"-advect(1, u)", "time = euler; advect = semi_lagrangian", infinite},
      {"-u", "time = euler", 1},
      {"-advect(1, u)", "time = ssp_rk43; advect = upwind(1)", 2},           // C of its Euler steps, of dt/2
      {"-advect(1, u)", "time = ssp_rk3; advect = muscl(minmod)", 2.0 / 3},  // 1/(1 + L/2)
      {"-advect(1, u)", "time = ssp_rk43; advect = muscl(minmod)", 4.0 / 3},
      {"-advect(1, u)", "time = ssp_rk43; advect = muscl(mc)", 1},
      {"lap(u)", "time = backward_euler", infinite},
      {"lap(u)", "time = crank_nicolson", 1.5},  // 2/sqrt(1 + 2r) - 1
  };
  for (const Case& c : cases) {
    const Positivity found = positivity_of(*line(c.rate, c.scheme, 0.2), 0.2);
    EXPECT_EQ(found.why, "");
    if (std::isinf(c.limit)) {
      EXPECT_TRUE(std::isinf(found.largest_step)) << c.rate << c.scheme << found.largest_step;
    } else {
      EXPECT_NEAR(found.largest_step, c.limit, 1e-6) << c.rate << c.scheme;
    }
    EXPECT_EQ(found.is_kept, c.limit > 0.2) << c.rate << c.scheme;
  }
}

/// Of any step: of rk4 in -100*u all weights are positive, however long it is, and in -v*u the one of v is negative in
/// short steps and not in long ones.
TEST(Positivity, IsKeptUpToTheLargestStepAndNotAbove) {
  const std::string carried = "initial u = 1\n  initial v = 100";
  for (const std::string time : {"euler", "rk2", "ssp_rk3", "rk4"}) {
    for (const std::string rate : {"-100*u", "lap(u)", "-v*u", "v - u", "-advect(4, u) + lap(u)"}) {
      for (const double step : {1e-4, 1e-2, 0.03194888178913738, 0.2, 3.0}) {
        const auto opened =
            open_scene("model m { field u, v; dt(u) = " + rate + "; dt(v) = 0*u }\nscheme q { time = " + time +
                       " }\nscene s : m with q {\n  grid x = 0 .. 8, cells 8, periodic\n  " + carried +
                       fmt::format("\n  time 0 .. {}, step {}\n}}\n", 2 * step, step));
        const Positivity found = positivity_of(*opened, step);
        EXPECT_EQ(found.why, "");
        if (std::abs(found.largest_step - step) > 1e-3 * step)
          EXPECT_EQ(found.is_kept, step < found.largest_step) << time << " " << rate << " " << step;
      }
    }
  }
}

std::vector<Wave> waves(const std::string& rate, const std::string& scheme, double step) {
  const auto session = line(rate, scheme, step);
  return waves_of(*session, verdict_of(*session).worst, step);
}

/// Section 1: theta = pi/4, nu = 0.5. Other values from g = 1 - nu*(1 - exp(-i theta)).
TEST(Waves, OfUpwindDifferencesAreThoseOfTheTable) {
  const std::vector<Wave> half = waves("-advect(1, u)", "time = euler; advect = upwind(1)", 0.5);
  ASSERT_EQ(half.size(), 4u);
  EXPECT_EQ(half[1].cells, 8);
  EXPECT_NEAR(half[1].growth, 0.9238795325, 1e-10);
  EXPECT_NEAR(half[1].phase, 1.0, 1e-9);
  for (const Wave& wave : waves("-advect(1, u)", "time = euler; advect = upwind(1)", 0.25)) {
    const double theta = 2 * pi / wave.cells;
    const std::complex<double> g = 1.0 - 0.25 * (1.0 - std::polar(1.0, -theta));
    EXPECT_NEAR(wave.growth, std::abs(g), 1e-12);
    EXPECT_NEAR(wave.phase, -std::arg(g) / (0.25 * theta), 1e-9);
    EXPECT_NEAR(wave.exact_growth, 1, 1e-9);
  }
}

TEST(Waves, OfDiffusionStandAndFall) {
  for (const Wave& wave : waves("lap(u)", "time = euler", 0.3)) {
    const double theta = 2 * pi / wave.cells;
    EXPECT_NEAR(wave.growth, std::abs(1 - 4 * 0.3 * std::pow(std::sin(theta / 2), 2)), 1e-12);
    EXPECT_NEAR(wave.exact_growth, std::exp(-0.3 * theta * theta), 1e-9);
    EXPECT_TRUE(std::isnan(wave.phase));
  }
}

/// sin(omega dt/2) = nu sin(theta/2), of waves to both sides; none grows.
TEST(Waves, OfTheWaveEquationByVerletAreItsDispersion) {
  const auto session = open_scene(
      "model m { field u; dt(dt(u)) = lap(u) }\nscheme c { time = verlet }\nscene s : m with c {\n  grid x = 0 .. 32, "
      "cells 32, periodic\n  initial u = sin(2*pi*x/32)\n  initial dt(u) = 0\n  time 0 .. 8, step 0.8\n}\n");
  const std::vector<Wave> found = waves_of(*session, verdict_of(*session).worst, 0.8);
  ASSERT_EQ(found.size(), 8u);
  for (const Wave& wave : found) {
    const double theta = 2 * pi / wave.cells;
    EXPECT_NEAR(wave.growth, 1, 1e-9);
    EXPECT_NEAR(wave.phase, 2 * std::asin(0.8 * std::sin(theta / 2)) / (0.8 * theta), 1e-7);
  }
}

}  // namespace
}  // namespace dpde::stability
