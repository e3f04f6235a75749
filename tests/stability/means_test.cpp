// SPDX-License-Identifier: Apache-2.0
// Steps with means and sums of fields in them, and with events: limits by hand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

StabilityReport verdict_of_scene(const std::string& equation, const std::string& time, const std::string& rest) {
  return verdict_of(*open_scene("model m { field u; " + equation + " }\nscheme c { time = " + time +
                                "; dx = central(2); advect = central(2) }\nscene s : m with c { " + rest + " }\n"));
}

/// A string that its own slopes tighten: dt(dt(u)) = (c + b mean(u_x^2)) u_xx with Verlet's steps is stable up to
/// h/sqrt(c + b mean), the mean that of all cells.
TEST(Means, OfAllCellsStandInCoefficients) {
  for (const int cells : {12, 17, 25, 40}) {
    const double h = 1.0 / cells;
    const auto u = [&](int i) { return std::exp(-std::pow(((i + 0.5) * h - 0.5) / 0.08, 2)); };
    double mean = 0;
    for (int i = 0; i < cells; ++i) mean += std::pow((u((i + 1) % cells) - u((i + cells - 1) % cells)) / (2 * h), 2);
    mean /= cells;
    const double half_angle = std::numbers::pi * (cells / 2) / cells;
    const StabilityReport verdict = verdict_of_scene(
        "dt(dt(u)) = (1 + 2*mean(dx(u)^2))*lap(u)", "verlet",
        fmt::format("grid x = 0 .. 1, cells {}, periodic; initial u = exp(-((x - 0.5)/0.08)^2); initial dt(u) = 0; "
                    "time 0 .. 1, step 1/2000",
                    cells));
    EXPECT_NEAR(verdict.limit.step * std::sqrt(1 + 2 * mean) * std::sin(half_angle), h, 5e-3 * h) << cells;
  }
}

/// dt(u) = -K mean(u^2) u about u = A sin: what lies along u decays three times as fast as the rest, with the rate
/// 3 K A^2/2, and no wave by itself shows it.
TEST(Means, OfSquaresTieCellsTogether) {
  const char* walls[] = {", periodic; initial u = 3*sin(2*pi*x)", "; boundary u: all = 0; initial u = 3*sin(pi*x)"};
  for (const char* wall : walls) {
    for (const int cells : {7, 400}) {
      const StabilityReport verdict =
          verdict_of_scene("dt(u) = -2*mean(u^2)*u + 1e-9*lap(u)", "euler",
                           fmt::format("grid x = 0 .. 1, cells {}{}; time 0 .. 1, step 1/2000", cells, wall));
      EXPECT_TRUE(verdict.is_of_means);
      EXPECT_NEAR(verdict.limit.step, 2 / (3 * 2 * 4.5), 1e-3 * 2 / 27) << cells << wall;
      EXPECT_EQ(verdict.growth_rate, 0);
    }
  }
}

/// The mean of q u, where q depends on the position: for constant u the rate is mean(q).
TEST(Means, ThatCountByCoefficients) {
  for (const int cells : {20, 600}) {
    const StabilityReport verdict = verdict_of(*open_scene(fmt::format(
        "model m {{ field u; coefficient q; dt(u) = -mean(q*u) + 1e-6*lap(u) }}\nscheme c {{ time = euler }}\n"
        "scene s : m with c {{ grid x = 0 .. 1, cells {}, periodic; q = 8 + 7*sin(2*pi*x); initial u = 1; "
        "time 0 .. 1, step 1/2000 }}\n",
        cells)));
    EXPECT_NEAR(verdict.limit.step, 2.0 / 8, 1e-3 * 2 / 8) << cells;
  }
}

/// A mean that counts by q, of mean 8, or by the field itself: its eigenvalue is known, and the limit is that of the
/// scheme over it. Most steps a little beyond it would not have grown a hundredfold in the steps of a run.
struct ByMeans {
  const char* time;
  double factor;  // of the scheme's limit along the eigenvalue
};

StabilityReport verdict_of_means(const std::string& equations, const std::string& time, const std::string& starts,
                                 const std::string& step = "1/2000") {
  return verdict_of(*open_scene(
      fmt::format("model m {{ coefficient q; {} }}\nscheme c {{ time = {} }}\n"
                  "scene s : m with c {{ grid x = 0 .. 1, cells 600, periodic; {}; time 0 .. 1, step {} }}\n",
                  equations, time, starts, step)));
}

const std::string uneven = "q = 8 + 7*sin(2*pi*x); ";

TEST(Means, LimitsAreThoseOfDecay) {
  for (const auto& [time, factor] : {ByMeans{"euler", 2}, ByMeans{"ssp_rk3", 2.51274533}, ByMeans{"rk4", 2.78529356},
                                     ByMeans{"ab2", 1}, ByMeans{"ab3", 6.0 / 11}}) {
    const StabilityReport verdict =
        verdict_of_means("field u; dt(u) = -mean(q*u) + 1e-6*lap(u)", time, uneven + "initial u = 1");
    EXPECT_TRUE(verdict.is_of_runs()) << time;
    EXPECT_NEAR(verdict.limit.step * 8 / factor, 1, 2.5e-3) << time;
    const StabilityReport steady = verdict_of_means("field u; dt(u) = -2*mean(u^2)*u + 1e-9*lap(u) + q", time,
                                                    "q = 27*sin(2*pi*x); initial u = 3*sin(2*pi*x)");
    EXPECT_NEAR(steady.limit.step * 27 / factor, 1, 2.5e-3) << time;
  }
}

const std::string oscillation = "field u, v; dt(u) = mean(q*v) + 1e-6*lap(u); dt(v) = -mean(q*u) + 1e-6*lap(v)";

TEST(Means, LimitsAreThoseOfOscillations) {
  for (const auto& [time, factor] :
       {ByMeans{"ssp_rk3", std::sqrt(3.0)}, ByMeans{"rk4", std::sqrt(8.0)}, ByMeans{"ab3", 0.7236}}) {
    const StabilityReport verdict = verdict_of_means(oscillation, time, uneven + "initial u = 1; initial v = 0");
    EXPECT_TRUE(verdict.is_of_runs()) << time;
    EXPECT_NEAR(verdict.limit.step * 8 / factor, 1, 2.5e-3) << time;
  }
}

/// u and v that turn one another by means, at 8 sqrt(2), and are damped or driven: the step at which a step of the
/// method multiplies by more than twice the growth of the equations. What the scene's own step is says nothing of it.
struct Turning {
  const char* time;
  double damped, driven, decay;
};

TEST(Means, LimitsDoNotDependOnTheStep) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const std::string turning = "field u, v; dt(u) = 2*mean(q*v) + 1e-6*lap(u); dt(v) = -mean(q*u) ";
  const std::string starts = uneven + "initial u = 1; initial v = 1";
  for (const auto& [time, damped, driven, decay] :
       {Turning{"euler", 0.00390625, 0.0119048, 0.25}, Turning{"rk2", 0.05214, 0.07121, 0.25},
        Turning{"rk4", 0.25371, 0.25554, 0.348162}, Turning{"ab2", 0.03751, 0.04541, 0.125}}) {
    for (const char* step : {"1/2000", "0.5"}) {
      const auto limit = [&](const std::string& equations) {
        return verdict_of_means(equations, time, starts, step).limit.step;
      };
      EXPECT_NEAR(limit(turning + "- 0.5*v") / damped, 1, 5e-3) << time << " " << step;
      EXPECT_NEAR(limit(turning + "+ 0.5*v") / driven, 1, 5e-3) << time << " " << step;
      EXPECT_NEAR(limit("field u, v; dt(u) = -mean(q*u) - 0.2*v; dt(v) = -0.5*v") / decay, 1, 5e-3) << time << step;
    }
  }
}

/// Damping 0.05 and frequency 8 sqrt(2): a step 1 % above the limit grows by 4e-7.
TEST(Means, ThatAreHardlyDampedHaveTheirLimit) {
  const StabilityReport verdict =
      verdict_of_means("field u, v; dt(u) = 2*mean(q*v) + 1e-6*lap(u); dt(v) = -mean(q*u) - 0.1*v", "euler",
                       uneven + "initial u = 1; initial v = 1");
  EXPECT_NEAR(verdict.limit.step / (0.1 / 128), 1, 5e-3);
}

/// As dt^2 and dt^4, by so little that a run of some hundred steps does not show it.
TEST(Means, ThatOscillateGrowAtEveryStep) {
  for (const auto& [time, order] : {ByMeans{"euler", 2}, ByMeans{"rk2", 4}, ByMeans{"ab2", 4}}) {
    const StabilityReport verdict = verdict_of_means(oscillation, time, uneven + "initial u = 1; initial v = 0");
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never) << time;
    EXPECT_NEAR(verdict.limit.order, order, 0.5) << time;
  }
}

/// Rates that a scheme remembers are as fast as the shortest wave, and noise in fields and in them is no growth.
TEST(Means, NoiseInWhatIsRememberedDoesNotGrow) {
  const StabilityReport verdict = verdict_of(
      *open_scene("model m { field u; coefficient q; dt(u) = 0.5*mean(q*u) + 0.01*lap(u) }\nscheme c { time = ab3 }\n"
                  "scene s : m with c { grid x = 0 .. 1, cells 600, periodic; q = 8 + 7*sin(2*pi*x); initial u = 1; "
                  "time 0 .. 1, step 1/360000 }\n"));
  EXPECT_NEAR(verdict.limit.step * 0.01 * 4 * 600 * 600, 6.0 / 11, 1e-3);
  EXPECT_LT(verdict.growth_rate, 8);
}

/// Fields that are kept at a constant norm do not count as growth of steps.
TEST(Means, OfNormsAreNotRefused) {
  const StabilityReport verdict = verdict_of_scene(
      "dt(u) = 0.1*lap(u)", "euler",
      "grid x = 0 .. 1, cells 16; boundary u: all = 0; initial u = x*(1 - x); after step: u = u/sqrt(mean(u^2)); "
      "time 0 .. 20, step 0.01");
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_FALSE(verdict.is_above());
}

/// The leapfrog lets what decays grow in each step, the mean too.
TEST(Means, OfLeapfrogNeverDecay) {
  const StabilityReport verdict =
      verdict_of_scene("dt(u) = -7*integral(u) + 0.001*lap(u)", "leapfrog",
                       "grid x = 0 .. 1, cells 12, periodic; initial u = cos(2*pi*x); time 0 .. 5, step 0.0001");
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never);
}

/// Three fields, v in two steps a step, so that no polynomial of rates is what the mean does. A few cells have the
/// exact answer, and what these equations do does not depend on how many there are.
struct TiedByMeans {
  std::string equations;
  int rank;
};

StabilityReport verdict_of_tied(const TiedByMeans& tied, int cells, double step) {
  std::string grid;
  for (int axis = 0; axis < tied.rank; ++axis)
    grid += fmt::format("grid {} = 0 .. 1, cells {}, periodic; ", "xy"[axis], cells);
  return verdict_of(*open_scene(
      fmt::format("model m {{ field u, v, w; {} }}\nscheme c {{ time = rk4 }}\nscene s : m with c {{ {}"
                  "initial u = 1; initial v = 1; initial w = 1; subcycle v in 2; time 0 .. 10, step {} }}\n",
                  tied.equations, grid, step)));
}

TEST(Means, OfSubcyclesAreAsOnFewCells) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const TiedByMeans all[] = {
      {"dt(u) = 10*mean(v) + 1e-3*mean(w); dt(v) = -10*mean(u); dt(w) = -0.1*w + 1e-3*mean(u)", 1},
      {"dt(u) = 10*mean(v, x) + 1e-3*mean(w); dt(v) = -10*mean(u, x); dt(w) = -0.1*w + 1e-3*mean(u, x)", 2},
      {"dt(u) = -0.1*u + 0.1*v + 0.1*w; dt(v) = -50*mean(v) + mean(u); dt(w) = -0.1*w + 0.1*u", 1},
      {"dt(u) = -0.1*u + 0.1*v + 0.1*w; dt(v) = -50*mean(v, y) + mean(u); dt(w) = -0.1*w + 0.1*u", 2},
      {"dt(u) = -8*mean(u) + mean(w); dt(v) = -20*v + mean(u); dt(w) = -0.1*w + 0.1*mean(v)", 1},
  };
  for (const TiedByMeans& tied : all) {
    const StabilityReport exact = verdict_of_tied(tied, 8, 0.01);
    const StabilityReport waves = verdict_of_tied(tied, tied.rank == 1 ? 20000 : 200, 0.01);
    EXPECT_TRUE(exact.is_of_grid) << tied.equations;
    EXPECT_FALSE(waves.is_of_grid) << tied.equations;
    EXPECT_EQ(waves.limit.kind, exact.limit.kind) << tied.equations;
    EXPECT_NEAR(waves.limit.step, exact.limit.step, 2e-3 * exact.limit.step) << tied.equations;
  }
}

/// What they let grow is not the equations': the limit is that of the steps without them.
TEST(Events, ThatAmplifyHideNoLimit) {
  const std::string grid = "grid x = 0 .. 1, cells 16, periodic; initial u = noise(1); time 0 .. 20, step 0.01; ";
  const std::string equation = "dt(u) = -advect(1, u) - 4*u";
  const StabilityReport plain = verdict_of_scene(equation, "ssp_rk3", grid);
  ASSERT_EQ(plain.limit.kind, StepLimit::Kind::limit);
  for (const char* event : {"after step: u = 1.2*u", "every 0.01: u = 1.2*u", "every 0.1: u = 1.2*u",
                            "every 0.1: u = 0.5*u", "at t = 5: u = 100*u"}) {
    const StabilityReport verdict = verdict_of_scene(equation, "ssp_rk3", grid + event);
    EXPECT_EQ(verdict.growth_rate, 0) << event;
    EXPECT_NEAR(verdict.limit.step, plain.limit.step, 2e-3 * plain.limit.step) << event;
  }
  const StabilityReport walled =
      verdict_of_scene("dt(u) = lap(u)", "euler",
                       "grid x = 0 .. 1, cells 300; boundary u: all = 0; initial u = sin(pi*x); "
                       "after step: u = 1.3*u; time 0 .. 1, step 1e-6");
  EXPECT_NEAR(walled.limit.step * 300 * 300, 0.5, 1e-2);
}

/// Two fields that an event mixes: growth of 1.1 a step is its own.
TEST(Events, ThatMixFieldsAreAllowedWhatTheyDo) {
  const StabilityReport verdict = verdict_of(*open_scene(
      "model m { field u, w; dt(u) = 0.1*lap(u) - 3*u; dt(w) = 0.1*lap(w) - 3*w }\nscheme c { time = euler }\n"
      "scene s : m with c { grid x = 0 .. 1, cells 16, periodic; initial u = noise(1); initial w = noise(2); "
      "after step: u += 0.1*w, w += 0.1*u; time 0 .. 20, step 0.01 }\n"));
  EXPECT_NEAR(verdict.limit.step, 2 / (3 + 0.1 * 4 * 256), 1e-4 * 0.019);
  EXPECT_NEAR(verdict.growth_by_events, std::log(1.1), 1e-9);
}

}  // namespace
}  // namespace dpde::stability
