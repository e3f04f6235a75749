// SPDX-License-Identifier: Apache-2.0
// Products by Fourier series without dealiasing: limits against runs below and above them.
#include "stability/step/folded_products.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// A steady flow, and noise of 1e-8 in it.
std::unique_ptr<driver::Session> vortices(int cells, const std::string& scheme, double step, int steps = 120) {
  return open_scene(
      fmt::format("model v {{ field w; solve lap(psi) = w for psi; dt(w) = -bracket(psi, w) }}\n"
                  "scheme c {{ time = rk4; lap = spectral; {} }}\nscene s : v with c {{\n"
                  "  grid x = 0 .. 2*pi, cells {}, periodic\n  grid y = 0 .. 2*pi, cells {}, periodic\n"
                  "  initial w = -5*cos(x + 2*y) + 1e-8*noise(1)\n  time 0 .. {}*{}, step {}\n}}\n",
                  scheme, cells, cells, steps, step, step));
}

double largest_after_run(driver::Session& session) {
  session.rollout().run();
  std::vector<double> values(session.workspace().cell_count());
  copy_out(session.workspace().layout(), session.rollout().final_states()[0], values);
  double largest = 0;
  for (const double value : values) largest = std::isfinite(value) ? std::max(largest, std::abs(value)) : INFINITY;
  return largest;
}

bool blows_up(driver::Session& session) {
  try {
    return !(largest_after_run(session) < 10);
  } catch (const std::exception&) {
    return true;
  }
}

TEST(FoldedProducts, LimitAsRunsDo) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: a verdict by runs";
  constexpr int cells = 32;
  const auto session = vortices(cells, "dx = spectral", 0.02);
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_TRUE(verdict.is_of_means);
  EXPECT_EQ(wave_text(verdict, session->problem()), "what products fold back");
  EXPECT_NE(folding_text(session->problem(), verdict), "");
  EXPECT_FALSE(blows_up(*vortices(cells, "dx = spectral", 0.93 * verdict.limit.step)));
  EXPECT_TRUE(blows_up(*vortices(cells, "dx = spectral", 1.15 * verdict.limit.step)));
}

/// Without it the limit falls faster than the cells.
TEST(FoldedProducts, AreCutByDealiasing) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: six verdicts";
  const auto limit_of = [](int cells, const std::string& scheme) {
    const auto session = vortices(cells, scheme, 0.02);
    const StabilityReport verdict = verdict_of(*session);
    EXPECT_EQ(folding_text(session->problem(), verdict).empty(), scheme != "dx = spectral");
    return verdict.limit.step;
  };
  const std::string dealiased = "dx = spectral; dealias = two_thirds";
  EXPECT_GT(limit_of(24, "dx = spectral") / limit_of(32, "dx = spectral"), 1.6);
  // Of w = -5*cos(x + 2*y), whose wind is (2, -1), the fastest wave is the shortest that is kept along both axes.
  const auto frequency = [](double k) { return 3 * k * (1 - 5 / (2 * k * k)); };
  EXPECT_NEAR(limit_of(24, dealiased) / limit_of(32, dealiased), frequency(10) / frequency(7), 1e-2);
  const double limit = limit_of(32, dealiased);
  EXPECT_FALSE(blows_up(*vortices(32, dealiased, 0.6 * limit)));
}

/// On very many cells runs take minutes: the verdict then uses waves only and reports that. It still names the remedy.
TEST(FoldedProducts, AreLeftOutOnLargeGridsUnlessAskedFor) {
  const auto verdict_on = [](int cells, bool at_all_cells) {
    const auto session = open_scene(
        fmt::format("model m {{ field u; dt(u) = -u*dx(u) }}\nscheme c {{ time = rk4; dx = spectral }}\n"
                    "scene s : m with c {{\n  grid x = 0 .. 2*pi, cells {}, periodic\n  initial u = 2 + sin(x)\n"
                    "  time 0 .. 1, step 1/{}\n}}\n",
                    cells, 4 * cells));
    const StabilityReport verdict = verdict_of(*session, {at_all_cells});
    EXPECT_EQ(verdict.leaves_out_folding(), !verdict.is_of_runs());
    EXPECT_EQ(folding_text(session->problem(), verdict).empty(), !verdict.leaves_out_folding());
    return verdict;
  };
  const StabilityReport large = verdict_on(160'000, false), small = verdict_on(64, false), asked = verdict_on(64, true);
  EXPECT_TRUE(large.leaves_out_folding());
  EXPECT_FALSE(small.leaves_out_folding());
  EXPECT_EQ(small.limit.step, asked.limit.step);
  // Of waves: sqrt(8) over the fastest rate, 3 pi/h.
  EXPECT_NEAR(large.limit.step / (std::sqrt(8) / (3 * 80'000)), 1, 1e-3);
}

/// Differences cause no aliasing, nor do products without derivatives.
TEST(FoldedProducts, AreOfFourierSeries) {
  EXPECT_FALSE(folds_products(vortices(16, "dx = central(4)", 0.02)->problem(), {}));
  const auto reaction = open_scene(
      "model m { field u; dt(u) = 0.1*lap(u) - u^3 }\nscheme c { time = rk4; lap = spectral }\n"
      "scene s : m with c { grid x = 0 .. 1, cells 16, periodic; initial u = sin(2*pi*x); time 0 .. 1, step 1e-3 }\n");
  EXPECT_FALSE(folds_products(reaction->problem(), {}));
}

}  // namespace
}  // namespace dpde::stability
