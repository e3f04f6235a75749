// SPDX-License-Identifier: Apache-2.0
// Limits by all disturbances of a scene's own grid, compared with eigenvalues in closed form, dense matrices and runs;
// for random models also with limits by waves.
#include "stability/step/own_grid.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "../support/dense.h"
#include "stability/equations.h"
#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/trial.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

using std::numbers::pi;

StabilityReport own_verdict(driver::Session& session) {
  const StabilityReport verdict = verdict_of(session);
  EXPECT_TRUE(verdict.is_of_grid && verdict.is_exact);
  return verdict;
}

/// The largest eigenvalue of the second difference between walls that are mirrors of the sign is 4/h^2 along each axis;
/// two fields of a wave are limited by 2 sqrt(2)/omega with rk4.
TEST(OwnGrid, LimitsBetweenWallsAreThoseOfClosedForms) {
  const auto limit = [](const std::string& equations, const std::string& scheme, const std::string& rest) {
    const std::string text =
        "model m { " + equations + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n" + rest;
    return own_verdict(*open_scene(text + "  time 0 .. 1, step 1/1000\n}\n")).limit.step;
  };
  const std::string plane =
      "  grid x = 0 .. 12, cells 12\n  grid y = 0 .. 9, cells 9\n  boundary u: all = 0\n  initial u = x*y\n";
  EXPECT_NEAR(limit("field u; dt(u) = lap(u)", "time = euler", plane), 0.25, 3e-4);
  const std::string line =
      "  grid x = 0 .. 1, cells 40\n  boundary u: all = 0\n  boundary v: all = zero_gradient\n"
      "  initial u = sin(pi*x)\n  initial v = 0\n";
  EXPECT_NEAR(limit("field u, v; dt(u) = v; dt(v) = 9*lap(u)", "time = rk4", line), std::sqrt(2.0) / 40 / 3, 1e-4);
}

/// dt(u) = c(x)*lap(u): C L is similar to the symmetric C^(1/2) L C^(1/2). Frozen in the spot it would be 0.5/100.
TEST(OwnGrid, SpotsThatAreNarrowLimitLess) {
  const int n = 64;
  const auto session = open_scene(
      "model m { field u; dt(u) = (1 + 99*exp(-(x - 23.5)^2))*lap(u) }\nscheme c { time = euler }\nscene s : m with c "
      "{\n  grid x = 0 .. 64, cells 64, periodic\n  initial u = sin(2*pi*x/64)\n  time 0 .. 1, step 1/400\n}\n");
  const auto root = [](int i) { return std::sqrt(1 + 99 * std::exp(-(i - 23.0) * (i - 23.0))); };
  test::DenseMatrix matrix(n);
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i), next = static_cast<std::size_t>((i + 1) % n);
    matrix(at, at) = 2 * root(i) * root(i);
    matrix(at, next) = matrix(next, at) = -root(i) * root((i + 1) % n);
  }
  const double limit = 2 / test::symmetric_eigenvalues(matrix).back();
  EXPECT_NEAR(own_verdict(*session).limit.step, limit, 1.5e-3 * limit);
}

/// Cells that become smaller towards walls, at one end and at both, and round a ring.
TEST(OwnGrid, StretchedAxesHaveTheLimitsOfRuns) {
  for (const std::string axis : {"0 .. 1, cells 96, stretched (exp(3*x) - 1)/(exp(3) - 1)",
                                 "0 .. 1, cells 64, stretched 0.5 + 0.5*tanh(2*(2*x - 1))/tanh(2)",
                                 "0 .. 2*pi, cells 48, periodic, stretched x + 0.6*sin(x)"}) {
    const std::string walls = axis.find("periodic") == std::string::npos ? "  boundary u: all = 0\n" : "";
    const auto session = open_scene(
        fmt::format("model m {{ field u; dt(u) = lap(u) }}\nscheme c {{ time = euler }}\nscene s : m with c {{\n"
                    "  grid x = {}\n{}  initial u = sin(pi*x)\n  time 0 .. 1e-4, step 1e-7\n}}\n",
                    axis, walls));
    const double limit = own_verdict(*session).limit.step;
    EXPECT_NEAR(search_limit(*session, limit, 2e-3, 2, {.steps = 20000}).largest, limit, 5e-3 * limit) << axis;
  }
}

/// Explicit advection with implicit diffusion: the waves that limit an infinite line are longer than this grid.
TEST(OwnGrid, ImplicitSchemesAreLimitedByWavesThatFit) {
  const auto scene = [](const std::string& time, double nu) {
    return open_scene(
        fmt::format("model m {{ field u; dt(u) = -advect(1, u) + {}*lap(u) }}\n"
                    "scheme c {{ time = {}; implicit = all_but_advect }}\nscene s : m with c {{\n  grid x = 0 .. 1, "
                    "cells 32\n  boundary u: all = 0\n  initial u = sin(2*pi*x)\n"
                    "  time 0 .. 1, step 1/1000\n}}\n",
                    nu, time));
  };
  const auto free = scene("imex_euler", 0.2);
  EXPECT_EQ(own_verdict(*free).limit.kind, StepLimit::Kind::none);
  EXPECT_TRUE(try_step(*free, 0.5, {.steps = 2000}).value().is_stable);
  const auto limited = scene("ars222", 0.2);
  const double limit = own_verdict(*limited).limit.step;
  EXPECT_NEAR(search_limit(*limited, limit, 4e-3, 2, {.steps = 2000}).largest, limit, 0.01 * limit);
}

/// What explicit schemes cannot do on an endless line they can on 20 cells: the run decays. A mean that drifts by right
/// is no growth of the scheme's; a limit is found however far it is.
TEST(OwnGrid, WavesThatDoNotFitLimitNothing) {
  const auto verdict = [](const std::string& equations, const std::string& scheme, const std::string& rest,
                          double step) {
    return own_verdict(*open_scene(
        fmt::format("model m {{ {} }}\nscheme c {{ {} }}\nscene s : m with c {{\n  {}\n  time 0 .. {}, step {}\n}}\n",
                    equations, scheme, rest, 1000 * step, step)));
  };
  const std::string slopes = "grid x = 0 .. 1, cells 20; boundary u: all = zero_gradient; initial u = cos(pi*x)";
  for (const int cells : {8, 16, 20, 33}) {
    const std::string box = fmt::format(
        "grid x = 0 .. 1, cells {}; boundary u: all = zero_gradient; initial u = cos(pi*x); initial dt(u) = 0", cells);
    // 2 sqrt(2)/omega of the shortest wave between slopes, 2 n cos(pi/(2n))
    const double limit = std::numbers::sqrt2 / cells / std::cos(pi / (2 * cells));
    EXPECT_NEAR(verdict("field u; dt(dt(u)) = lap(u)", "time = rk4", box, 1e-3).limit.step, limit, 2e-3 * limit);
  }
  const StabilityReport ring =
      verdict("field u; coefficient c; dt(dt(u)) = div(c*grad(u))", "time = rk4",
              "grid x = 0 .. 1, cells 20, periodic; c = 1 + 0.5*sin(2*pi*x); initial u = cos(2*pi*x); "
              "initial dt(u) = 0",
              1e-3);
  EXPECT_NEAR(ring.limit.step, 0.0597, 0.01 * 0.0597);  // as runs have it
}

/// A limit that waves have found may be the grid's too: what lies above it grows, and is refused.
TEST(OwnGrid, StepsAboveALimitGrow) {
  const auto session = open_scene(
      "model m { field u; dt(u) = lap(u) }\nscheme c { time = euler }\nscene s : m with c {\n  grid x = 0 .. 1, cells "
      "40\n  boundary u: all = 0\n  initial u = sin(pi*x)\n  time 0 .. 1, step 1/1600\n}\n");
  const StabilityReport verdict = own_verdict(*session);
  EXPECT_NEAR(verdict.growth, 3, 0.02);  // |1 - 4 dt/h^2|
  EXPECT_TRUE(verdict.is_above());
  EXPECT_TRUE(verdict.ruins_run());
}

/// |g| = 1 + (omega dt)^4/8 with rk2, at every step; with drifting means in addition.
TEST(OwnGrid, WeakGrowthIsNoLimit) {
  for (const std::string walls : {"all = 0", "all = zero_gradient", "x.low = 0, x.high = zero_gradient"}) {
    const auto verdict = [&](double step) {
      return own_verdict(*open_scene(
          fmt::format("model m {{ field u; dt(dt(u)) = lap(u) }}\nscheme c {{ time = rk2 }}\nscene s : m with c {{\n"
                      "  grid x = 0 .. 1, cells 30\n  boundary u: {}\n  initial u = sin(pi*x)\n"
                      "  initial dt(u) = 0\n  time 0 .. {}, step {}\n}}\n",
                      walls, 2e4 * step, step)));
    };
    const double step = 4e-3, z = 60 * step;
    EXPECT_EQ(verdict(step).limit.kind, StepLimit::Kind::never) << walls;
    EXPECT_TRUE(verdict(step).limit.is_weak()) << walls;
    EXPECT_NEAR(verdict(step).growth - 1, std::pow(z, 4) / 8, 0.05 * std::pow(z, 4)) << walls;
    EXPECT_TRUE(verdict(step).ruins_run()) << walls;
    EXPECT_FALSE(verdict(1e-4).ruins_run()) << walls;
  }
}

/// -dx(u) + nu*lap(u) + r*u between values of 0: rows (lower, middle, upper) are similar to symmetric ones with
/// sqrt(lower*upper), far from normal as the flow is strong. What grows slowly by right is no fault of the step.
TEST(OwnGrid, SlowGrowthOfMatricesFarFromNormalIsTheEquations) {
  constexpr int n = 64;
  const double nu = 0.025, r = 10.75, lower = nu * n * n + 0.5 * n, upper = nu * n * n - 0.5 * n;
  test::DenseMatrix matrix(n);
  for (std::size_t i = 0; i < n; ++i) {
    matrix(i, i) = r - lower - upper - (i == 0 ? lower : 0) - (i + 1 == n ? upper : 0);
    if (i > 0) matrix(i, i - 1) = matrix(i - 1, i) = std::sqrt(lower * upper);
  }
  const std::vector<double> rates = test::symmetric_eigenvalues(matrix);
  ASSERT_GT(rates.back(), 0);
  const StabilityReport verdict = own_verdict(*open_scene(
      "model m { field u; dt(u) = -dx(u) + 0.025*lap(u) + 10.75*u }\nscheme c { time = rk4 }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 64\n  boundary u: x = 0\n  initial u = sin(pi*x)\n  time 0 .. 4, step 1/1024\n}\n"));
  EXPECT_NEAR(verdict.growth_rate, rates.back(), 0.02 * rates.back());
  EXPECT_NEAR(verdict.limit.step, 2.785293563 / -rates.front(), 0.02 * verdict.limit.step);
}

/// A limit is found however short the scene's own step is.
TEST(OwnGrid, LimitsFarFromTheScenesStepAreFound) {
  const auto session = open_scene(
      "model m { field u; dt(u) = -advect(2, u) }\nscheme c { time = rk4; advect = upwind(3) }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 8\n  boundary u: x.low = 0, x.high = outflow\n  initial u = sin(pi*x)\n"
      "  time 0 .. 1, step 1e-7\n}\n");
  const double limit = own_verdict(*session).limit.step;
  EXPECT_GT(limit, 0.05);
  EXPECT_NEAR(search_limit(*session, limit, 4e-3, 2, {.steps = 2000}).largest, limit, 0.3 * limit);
}

/// Steps that read the time are analysed at some moments, as an estimate. Other states make other steps.
TEST(OwnGrid, IsNotAskedWhereTheStateMatters) {
  enum class Is { exact, estimate, of_waves };
  const auto kind = [](const std::string& equation, const std::string& more) {
    const StabilityReport verdict =
        verdict_of(*open_scene("model m { field u; " + equation +
                               " }\nscheme c { time = euler }\nscene s : m with c {\n  grid x = 0 .. 1, cells 32\n"
                               "  boundary u: all = 0\n  initial u = sin(pi*x)\n" +
                               more + "  time 0 .. 1, step 1/10000\n}\n"));
    return !verdict.is_of_grid ? Is::of_waves : verdict.is_exact ? Is::exact : Is::estimate;
  };
  EXPECT_EQ(kind("dt(u) = 0.1*lap(u) + cos(t)", ""), Is::exact);
  EXPECT_EQ(kind("dt(u) = (2 + cos(t))*lap(u)", ""), Is::estimate);
  EXPECT_EQ(kind("dt(u) = if(t > 0.5, 100, 1)*lap(u)", ""), Is::estimate);
  EXPECT_EQ(kind("dt(u) = (1 + max(0, 10*(t - 0.5)))*lap(u)", ""), Is::estimate);
  EXPECT_EQ(kind("dt(u) = 0.1*lap(u) - u^3", ""), Is::of_waves);
  EXPECT_EQ(kind("control F; dt(u) = F*lap(u)", "  F = 0.1 every 0.1\n"), Is::of_waves);
  EXPECT_EQ(kind("control field F; dt(u) = F*lap(u)", "  F = 0.1 every 0.1\n"), Is::of_waves);
}

/// The limit is that of the moment with the fastest rate, whatever the moment at which the run begins.
TEST(OwnGrid, OfTheWorstMomentIsTheLimit) {
  const auto session = open_scene(
      "model m { field u; dt(u) = (1 + 3*exp(-((t - 0.7)/0.1)^2))*lap(u) }\nscheme c { time = euler }\nscene s : m "
      "with c {\n  grid x = 0 .. 32, cells 32\n  boundary u: all = 0\n  initial u = sin(pi*x/32)\n"
      "  time 0 .. 1, step 0.01\n}\n");
  EXPECT_NEAR(verdict_of(*session).limit.step, 0.5 / 4, 0.01 * 0.5 / 4);
}

class Lot {
 public:
  explicit Lot(unsigned seed) : random_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  template <class T>
  T of(const std::vector<T>& all) {
    return all[std::uniform_int_distribution<std::size_t>(0, all.size() - 1)(random_)];
  }
  bool happens() { return between(0, 1) < 0.5; }

 private:
  std::mt19937_64 random_;
};

/// Two fields on a ring of a few cells, coupled, with constant coefficients.
std::string drawn_scene(Lot& lot) {
  const auto terms = [&](const std::string& own, const std::string& other) {
    std::string text = fmt::format("{:.3f}*lap({})", lot.between(0.1, 2), own);
    if (lot.happens()) text += fmt::format(" - advect({:.3f}, {})", lot.between(-3, 3), own);
    if (lot.happens()) text += fmt::format(" - {:.3f}*{}", lot.between(0, 5), own);
    if (lot.happens()) text += fmt::format(" + {:.3f}*{}", lot.between(-4, 4), other);
    if (lot.happens()) text += fmt::format(" + {:.3f}*dx({})", lot.between(-2, 2), other);
    return text;
  };
  const std::string first = terms("u", "v"), second = terms("v", "u");
  const std::string time = lot.of<std::string>({"euler", "rk2", "ssp_rk3", "rk4", "ab2", "ab3"});
  const std::string advect = lot.of<std::string>({"central(2)", "central(4)", "upwind(1)", "upwind(3)", "spectral"});
  const std::string lap = lot.of<std::string>({"central(2)", "central(4)", "central(6)"});
  return fmt::format(
      "model m {{ field u, v\n  dt(u) = {}\n  dt(v) = {} }}\nscheme c {{ time = {}; advect = {}; lap = {} }}\n"
      "scene s : m with c {{\n  grid x = 0 .. 10, cells {}, periodic\n  initial u = 1\n  initial v = 0\n"
      "  time 0 .. 1, step 1/200\n}}\n",
      first, second, time, advect, lap, lot.of<int>({7, 8, 12, 15, 20}));
}

/// An independent check of the same step: the interpreter gives its matrix, cell by cell, and powers of it are formed.
TEST(OwnGrid, WavesOfSmallRingsSayTheSame) {
  Lot lot(20261126);
  int limits = 0;
  for (int i = 0; i < 60; ++i) {
    const std::string text = drawn_scene(lot);
    const auto session = open_scene(text);
    const StabilityReport verdict = verdict_of(*session);
    std::string why;
    const std::optional<LinearStep> linear = linear_step(*session, why);
    const Equations equations(session->problem());
    const auto grid = OwnGrid::make(*session, linear.value(), verdict.worst, verdict.step, equations);
    ASSERT_TRUE(grid.has_value()) << text;
    EXPECT_TRUE(verdict.is_exact) << text;
    if (grid->growth_rate() > 0) continue;  // how much of it short waves may have is judged by each in its own way
    EXPECT_EQ(verdict.growth_rate, 0) << text;
    if (verdict.limit.kind == StepLimit::Kind::limit) {
      ++limits;
      EXPECT_TRUE(grid->is_stable(0.995 * verdict.limit.step)) << verdict.limit.step << "\n" << text;
      EXPECT_FALSE(grid->is_stable(1.005 * verdict.limit.step)) << verdict.limit.step << "\n" << text;
    }
    if (verdict.limit.kind == StepLimit::Kind::never) continue;
    EXPECT_EQ(grid->is_stable(verdict.step), !verdict.is_above()) << verdict.limit.step << "\n" << text;
  }
  EXPECT_GT(limits, 40);
}

/// Boundary conditions at outflow and at inflow.
std::string drawn_wall(Lot& lot, bool is_outflow) {
  const std::string mixed = fmt::format("mixed({:.2f}, 1, 0)", lot.between(0.1, 20));
  return is_outflow ? lot.of<std::string>({"0", "zero_gradient", mixed, "linear", "outflow"})
                    : lot.of<std::string>({"0", "zero_gradient", mixed});
}

/// One or two fields between walls, on cells of one size or others, with schemes of all kinds.
std::string drawn_line(Lot& lot) {
  const bool are_two = lot.happens(), has_coefficient = lot.happens(), is_implicit = lot.happens();
  std::string walls;
  const auto terms = [&](const std::string& own, const std::string& other) {
    std::string text =
        has_coefficient ? "div(k*grad(" + own + "))" : fmt::format("{:.3f}*lap({})", lot.between(0.05, 1), own);
    const double speed = lot.between(-3, 3);
    text += fmt::format(" - advect({:.3f}, {})", speed, own);
    if (lot.happens()) text += fmt::format(" - {:.3f}*{}", lot.between(0, 5), own);
    if (are_two && lot.happens()) text += fmt::format(" + {:.3f}*{}", lot.between(-3, 3), other);
    walls += fmt::format("  boundary {}: x.low = {}, x.high = {}\n", own, drawn_wall(lot, speed < 0),
                         drawn_wall(lot, speed > 0));
    return text;
  };
  std::string equations = "field u; coefficient k; dt(u) = " + terms("u", "v"), starts = "  initial u = sin(pi*x)\n";
  if (are_two) equations += "\nfield v; dt(v) = " + terms("v", "u"), starts += "  initial v = 0\n";
  const std::string time = is_implicit ? lot.of<std::string>({"imex_euler", "ars222", "ars443"})
                                       : lot.of<std::string>({"euler", "rk2", "ssp_rk3", "rk4", "ab2", "ab3"});
  const std::string advect = lot.of<std::string>({"central(2)", "central(4)", "upwind(1)", "upwind(3)", "upwind(5)"});
  const std::string cells = lot.of<std::string>(
      {"8", "20", "33", "20, stretched 0.3*x + 0.7*x^2", "33, stretched 0.5 + 0.5*tanh(2*(2*x - 1))/tanh(2)"});
  return fmt::format(
      "model m {{ {} }}\nscheme c {{ time = {}; advect = {}; lap = {} }}\nscene s : m with c {{\n"
      "  grid x = 0 .. 1, cells {}\n  k = {}\n{}{}  time 0 .. 1, step 1e-4\n}}\n",
      equations, time, advect, lot.of<std::string>({"central(2)", "central(4)"}), cells,
      lot.of<std::string>({"0.1 + x^2", "exp(-2*x)", "1 + 0.5*sin(6*x)"}), walls, starts);
}

/// Runs grow beyond what is predicted, and not before. Where a flow meets a wall they may bear a little more, as what
/// grows on its way there has an end.
TEST(OwnGrid, LimitsBetweenWallsAreThoseOfRuns) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  Lot lot(20261127);
  int limits = 0;
  const int count = testing::is_thorough() ? 18 : 9;
  for (int i = 0; i < count; ++i) {
    const std::string text = drawn_line(lot);
    const auto session = open_scene(text);
    const StabilityReport verdict = own_verdict(*session);
    if (verdict.growth_rate > 0) continue;
    if (verdict.limit.kind == StepLimit::Kind::none) {
      for (const double step : {1e-4, 1e-2, 1.0})
        EXPECT_TRUE(try_step(*session, step, {.steps = 2000}).value().is_stable) << step << "\n" << text;
      continue;
    }
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << text;
    ++limits;
    const double limit = verdict.limit.step;
    const Search found = search_limit(*session, limit, 4e-3, 2, {.steps = 4000});
    EXPECT_GT(found.largest, 0.99 * limit) << text;
    EXPECT_LT(found.largest, 1.35 * limit) << text;
  }
  EXPECT_GT(limits, count / 2);
}

}  // namespace
}  // namespace dpde::stability
