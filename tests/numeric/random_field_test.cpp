// SPDX-License-Identifier: Apache-2.0
// Random fields and signals: mean square, spectrum, and equality wherever they are used.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::vector<double> field(const std::string& arguments, const std::vector<int>& cells,
                          const std::string& scheme = "time = euler") {
  std::string grid;
  for (std::size_t axis = 0; axis < cells.size(); ++axis) {
    grid += std::string("  grid ") + "xyz"[axis] + " = -1 .. " + std::to_string(axis + 1) + ", cells " +
            std::to_string(cells[axis]) + ", periodic\n";
  }
  return run_scene("model m { field u; dt(u) = 0 }\nscheme c { " + scheme + " }\nscene s : m with c {\n" + grid +
                       "  initial u = random_field(" + arguments + ")\n  time 0 .. 1, step 1\n}\n",
                   "s")
      .state.at("u");
}

double mean(const std::vector<double>& u) {
  return std::accumulate(u.begin(), u.end(), 0.0) / static_cast<double>(u.size());
}
double mean_square(const std::vector<double>& u) {
  return std::inner_product(u.begin(), u.end(), u.begin(), 0.0) / static_cast<double>(u.size());
}

/// Energy of wave number n on a periodic line.
double energy(const std::vector<double>& u, int n) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const double angle = 2 * std::numbers::pi * n * (static_cast<double>(i) + 0.5) / static_cast<double>(u.size());
    sum += u[i] * std::polar(1.0, -angle);
  }
  return 2 * std::norm(sum / static_cast<double>(u.size()));
}

TEST(RandomField, HasMeanSquareOne) {
  for (const auto& cells : std::vector<std::vector<int>>{{64}, {32, 40}, {20, 24, 18}}) {
    for (const std::string arguments :
         {"seed = 1, lowest = 1, highest = 6", "seed = 7, lowest = 2, highest = 8, slope = -5/3"}) {
      const std::vector<double> u = field(arguments, cells);
      EXPECT_NEAR(mean(u), 0, 1e-12) << arguments;
      EXPECT_NEAR(mean_square(u), 1, 1e-12) << arguments;
    }
  }
}

TEST(RandomField, HasTheSpectrumThatWasAskedFor) {
  const std::vector<double> u = field("seed = 3, lowest = 2, highest = 9, slope = -2", {64});
  EXPECT_NEAR(energy(u, 1), 0, 1e-24);
  EXPECT_NEAR(energy(u, 10), 0, 1e-24);
  for (int n = 3; n <= 9; ++n) EXPECT_NEAR(energy(u, n) / energy(u, 2), 4.0 / (n * n), 1e-9) << n;
}

/// Of many waves only some are drawn, so the slope holds for the mean: here over 40 fields, for the energies below and
/// above |n| = 8.
TEST(RandomField, DrawsManyWavesByTheirEnergy) {
  double low = 0;
  const std::vector<int> cells{48, 48};
  for (int seed = 0; seed < 40; ++seed) {
    const std::vector<double> u =
        field("seed = " + std::to_string(seed) + ", lowest = 1, highest = 16, slope = -1", cells);
    for (int ny = -8; ny <= 8; ++ny) {
      for (int nx = -8; nx <= 8; ++nx) {
        const double size = std::hypot(nx, ny);
        if (size == 0 || size > 8) continue;
        std::complex<double> sum = 0;
        for (int j = 0; j < 48; ++j) {
          for (int i = 0; i < 48; ++i)
            sum += u[static_cast<std::size_t>(48 * j + i)] *
                   std::polar(1.0, -2 * std::numbers::pi * (nx * i + ny * j) / 48.0);
        }
        low += std::norm(sum / (48.0 * 48)) / 40;
      }
    }
  }
  // the weights 1/|n|^2 of all n in |n| <= 8 over those in |n| <= 16
  double below = 0, all = 0;
  for (int ny = -16; ny <= 16; ++ny) {
    for (int nx = -16; nx <= 16; ++nx) {
      const double size = std::hypot(nx, ny);
      if (size == 0 || size > 16) continue;
      all += 1 / (size * size);
      below += size <= 8 ? 1 / (size * size) : 0;
    }
  }
  EXPECT_NEAR(low, below / all, 0.02);
}

/// Energies over hundreds of orders of magnitude, increasing or decreasing.
TEST(RandomField, MayBeSteep) {
  for (const std::string slope : {"-20", "-12", "-10.5", "13", "20"}) {
    for (const auto& cells : std::vector<std::vector<int>>{{160}, {40, 36}}) {
      const std::string highest = cells.size() == 1 ? "64" : "16";
      const std::vector<double> u = field("seed = 1, lowest = 1, highest = " + highest + ", slope = " + slope, cells);
      EXPECT_NEAR(mean_square(u), 1, 1e-12) << slope;
    }
  }
}

TEST(RandomField, IsTheSameOnEveryGrid) {
  const std::string arguments = "seed = 5, lowest = 1, highest = 4, slope = -1";
  const std::vector<double> coarse = field(arguments, {12, 8}), fine = field(arguments, {36, 24});
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < 12; ++i) {
      const double inside = fine[static_cast<std::size_t>(36 * (3 * j + 1) + 3 * i + 1)];  // the same point
      EXPECT_NEAR(coarse[static_cast<std::size_t>(12 * j + i)], inside, 1e-12);
    }
  }
  const std::vector<double> single = field(arguments, {12, 8}, "time = euler; real = f32");
  for (std::size_t i = 0; i < coarse.size(); ++i) EXPECT_NEAR(single[i], coarse[i], 2e-5);
}

TEST(RandomField, DependsOnTheSeed) {
  const std::vector<double> one = field("seed = 1, lowest = 1, highest = 4", {32}),
                            other = field("seed = 2, lowest = 1, highest = 4", {32});
  EXPECT_LT(std::abs(std::inner_product(one.begin(), one.end(), other.begin(), 0.0) / 32), 0.95);
  EXPECT_EQ(one, field("highest = 4, seed = 1, lowest = 1", {32}));
}

/// A reading of the run equals the integral of the signal, which has mean 0 over the run.
TEST(RandomSignal, ForcesAnEquation) {
  const auto run = [](const std::string& rhs, const std::string& until) {
    return run_scene(
               "model m {\n  field u\n  control F\n  dt(u) = " + rhs +
                   "\n}\nscheme c { time = rk4 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 2, periodic\n"
                   "  F = random_signal(seed = 4, lowest = 1, highest = 5) every 1/64\n  initial u = 0\n  time 0 .. " +
                   until + ", step 1/64\n}\n",
               "s")
        .state.at("u")[0];
  };
  const std::string signal = "random_signal(seed = 4, lowest = 1, highest = 5)";
  EXPECT_NEAR(run(signal + " + 0*F", "1"), 0, 1e-12);
  EXPECT_NEAR(run(signal + "^2 + 0*F", "1"), 1, 1e-12);
  EXPECT_NEAR(run("F^2", "1"), 1, 1e-12);
}

TEST(RandomField, GoesThroughFunctionsAndGradients) {
  expect_certified(
      "function rough(x, a) = a*x*random_field(seed = 2, lowest = 1, highest = 3)\n"
      "model m { field u; coefficient f; param k; dt(u) = k*lap(u) + f*u + random_signal(seed = 1, lowest = 1, highest "
      "= 2) }\n"
      "scene s : m {\n  grid x = 0 .. 1, cells 9\n  grid y = 0 .. 2, cells 4, periodic\n  boundary u: x.low = "
      "random_signal(seed = 3, lowest = 1, highest = 2), x.high = zero_gradient\n"
      "  k = 0.02\n  f = 1 + rough(k, 3)\n  initial u = rough(2, k)\n  time 0 .. 1/4, step 1/64\n}\n"
      "task t : s {\n  unknown k from 0.03\n  unknown f\n  minimise mean(u^2)\n}\n",
      false);
}

}  // namespace
}  // namespace dpde::testing
