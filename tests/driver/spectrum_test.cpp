// SPDX-License-Identifier: Apache-2.0
// Spectra against explicit sums, known modes and known spectra; correlations and when they are lost.
#include "training/tests/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <limits>

#include "support/split_mix.h"

namespace dpde::training {
namespace {

using Cells = std::vector<int>;

std::vector<model::Axis> axes_of(const Cells& cells, const std::vector<double>& lengths) {
  std::vector<model::Axis> axes;
  for (std::size_t a = 0; a < cells.size(); ++a) {
    model::Axis axis;
    axis.name = std::string(1, "xyz"[a]);
    axis.high = lengths[a];
    axis.cells = cells[a];
    axis.topology = Topology::periodic;
    axes.push_back(axis);
  }
  return axes;
}

/// At the centres, in fractions of the box.
std::vector<double> field_of(const Cells& cells, const std::function<double(double, double, double)>& f) {
  const auto along = [&](std::size_t a) { return a < cells.size() ? cells[a] : 1; };
  std::vector<double> values;
  for (int z = 0; z < along(2); ++z) {
    for (int y = 0; y < along(1); ++y) {
      for (int x = 0; x < along(0); ++x)
        values.push_back(f((x + 0.5) / along(0), (y + 0.5) / along(1), (z + 0.5) / along(2)));
    }
  }
  return values;
}

std::vector<double> random_field(const Cells& cells, std::uint64_t seed) {
  testing::SplitMix random(seed);
  return field_of(cells, [&](double, double, double) { return random.uniform(0, 1) - 0.3; });
}

std::vector<double> spectrum_of(const Cells& cells, const std::vector<double>& lengths,
                                const std::vector<double>& values) {
  Spectrum spectrum(axes_of(cells, lengths));
  std::vector<double> energies(spectrum.shell_count());
  spectrum.add(values, energies);
  return energies;
}

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

struct Grid {
  Cells cells;
  std::vector<double> lengths;
};
const std::vector<Grid> grids{{{1}, {1}},
                              {{2}, {3}},
                              {{3}, {1}},
                              {{7}, {1}},
                              {{8}, {2}},
                              {{30}, {1}},
                              {{1, 6}, {1, 2}},
                              {{5, 4}, {1, 1}},
                              {{12, 9}, {2, 1}},
                              {{3, 5, 4}, {1, 2, 1.5}},
                              {{1, 1, 7}, {1, 1, 1}}};

TEST(Spectrum, HoldsTheWholeEnergy) {
  for (const Grid& grid : grids) {
    const std::vector<double> values = random_field(grid.cells, 5);
    double squares = 0;
    for (const double value : values) squares += value * value / 2;
    EXPECT_NEAR(sum_of(spectrum_of(grid.cells, grid.lengths, values)), squares / static_cast<double>(values.size()),
                1e-13)
        << "Parseval";
  }
}

/// Every mode as the sum that defines it.
TEST(Spectrum, IsThatOfSumsWrittenOut) {
  for (const Grid& grid : grids) {
    const std::vector<double> values = random_field(grid.cells, 7),
                              found = spectrum_of(grid.cells, grid.lengths, values);
    const auto n = [&](std::size_t a) { return a < grid.cells.size() ? grid.cells[a] : 1; };
    double longest = 0;
    for (std::size_t a = 0; a < grid.cells.size(); ++a) longest = std::max(longest, n(a) > 1 ? grid.lengths[a] : 0);
    std::vector<double> expected(found.size());
    for (int kz = -((n(2) - 1) / 2); kz <= n(2) / 2; ++kz) {
      for (int ky = -((n(1) - 1) / 2); ky <= n(1) / 2; ++ky) {
        for (int kx = -((n(0) - 1) / 2); kx <= n(0) / 2; ++kx) {
          std::complex<double> mode = 0;
          std::size_t i = 0;
          field_of(grid.cells, [&](double x, double y, double z) {
            mode += values[i++] * std::exp(std::complex<double>(0, -2 * M_PI * (kx * x + ky * y + kz * z)));
            return 0.0;
          });
          const auto waves = [&](std::size_t a, int k) { return k == 0 ? 0 : k * longest / grid.lengths[a]; };
          const double length =
              std::sqrt(std::pow(waves(0, kx), 2) + std::pow(waves(1, ky), 2) + std::pow(waves(2, kz), 2));
          const auto shell = static_cast<std::size_t>(length + 0.5);
          ASSERT_LT(shell, expected.size());
          expected[shell] += std::norm(mode / static_cast<double>(values.size())) / 2;
        }
      }
    }
    for (std::size_t s = 0; s < found.size(); ++s) EXPECT_NEAR(found[s], expected[s], 1e-14) << s;
  }
}

TEST(Spectrum, KnowsAMode) {
  const auto plane = spectrum_of({16, 16}, {2, 2}, field_of({16, 16}, [](double x, double y, double) {
                                   return 3 + 0.5 * std::cos(2 * M_PI * (3 * x + 4 * y) + 1);
                                 }));
  for (std::size_t s = 0; s < plane.size(); ++s) EXPECT_NEAR(plane[s], s == 0 ? 4.5 : s == 5 ? 0.0625 : 0, 1e-14) << s;
  // A box twice as long along x: two waves along y have wavenumber four in units of the longest axis.
  const auto box = spectrum_of({24, 12}, {4, 2},
                               field_of({24, 12}, [](double, double y, double) { return std::sin(2 * M_PI * 2 * y); }));
  for (std::size_t s = 0; s < box.size(); ++s) EXPECT_NEAR(box[s], s == 4 ? 0.25 : 0, 1e-14) << s;
}

/// Modes along the diagonal and the axes with amplitudes that follow a power law.
TEST(Spectrum, KnowsASpectrum) {
  const int n = 32;
  testing::SplitMix random(3);
  std::vector<double> phases;
  for (int k = 0; k <= 15; ++k) phases.push_back(2 * M_PI * random.uniform(0, 1));
  const auto field = field_of({n, n, 4}, [&](double x, double y, double) {
    double sum = 0;
    for (int k = 1; k <= 15; ++k)
      sum +=
          2 * std::pow(k, -1.5) * std::cos(2 * M_PI * k * (k % 2 == 0 ? x : y) + phases[static_cast<std::size_t>(k)]);
    return sum;
  });
  const auto found = spectrum_of({n, n, 4}, {1, 1, 1}, field);
  for (std::size_t s = 1; s <= 15; ++s) EXPECT_NEAR(found[s], std::pow(static_cast<double>(s), -3), 1e-14) << s;
}

TEST(Spectrum, TellsWhichShellsAreWhole) {
  const auto last = [](const Cells& cells, const std::vector<double>& lengths) {
    return Spectrum(axes_of(cells, lengths)).last_resolved();
  };
  EXPECT_EQ(last({32}, {1}), 15U);
  EXPECT_EQ(last({33}, {1}), 16U);
  EXPECT_EQ(last({32, 16}, {1, 1}), 7U);
  EXPECT_EQ(last({32, 16}, {2, 1}), 15U) << "the same spacing";
  EXPECT_EQ(last({8, 1}, {1, 1}), 3U) << "nothing varies along one cell";
  EXPECT_EQ(last({1}, {1}), 0U);
  EXPECT_NEAR(Spectrum(axes_of({8, 8}, {4, 2})).unit(), M_PI / 2, 1e-15);
}

TEST(Spectrum, DistanceIsInPowersOfTen) {
  const std::vector<double> data{9, 1, 0.1, 0.01, 0}, run{5, 10, 0.1, 0.001, 7};
  EXPECT_NEAR(distance(run, data, 1, 3, 1e-20), 2.0 / 3, 1e-14) << "one, none and one";
  EXPECT_NEAR(distance(run, data, 1, 4, 1e-20), 2.0 / 3, 1e-14) << "where there is nothing there is no ratio";
  EXPECT_NEAR(distance({0, 0, 1}, {0, 1, 1}, 1, 2, 1e-3), std::log10(1 / 2e-3) / 2, 1e-14)
      << "no energy counts as noise";
  EXPECT_EQ(distance({0, INFINITY}, {0, 1}, 1, 1, 0), INFINITY);
  EXPECT_TRUE(std::isnan(distance({1}, {1}, 1, 0, 0)));
}

TEST(Correlation, IsThatOfWhatVaries) {
  const Components a{{1, 2, 3, 6}}, b{{3, 2, 5, 10}};
  // Deviations (-2, -1, 0, 3) and (-2, -3, 0, 5).
  EXPECT_NEAR(correlation(a, b), 22 / std::sqrt(14 * 38), 1e-15);
  EXPECT_NEAR(correlation(a, a), 1, 1e-15);
  EXPECT_NEAR(correlation({{1, 2}, {5, 3}}, {{2, 1}, {1, 5}}), -1 * (0.5 + 4) / std::sqrt((0.5 + 2) * (0.5 + 8)), 1e-15)
      << "two components";
  EXPECT_TRUE(std::isnan(correlation({{2, 2}}, {{3, 3}}))) << "data that do not vary";
  EXPECT_TRUE(std::isnan(correlation({{2, 4}}, {{3, 3}})));
  EXPECT_TRUE(std::isnan(first_below({1, 2}, {1, std::nan("")}, 0.8).time));
  EXPECT_EQ(correlation({{2, 2}}, {{3, 4}}), 0);
  EXPECT_EQ(correlation({{2, std::nan("")}}, {{3, 4}}), 0);
}

TEST(Correlation, IsLostBetweenFrames) {
  const Crossing found = first_below({1, 2, 3, 4}, {0.95, 0.9, 0.7, 0.95}, 0.8);
  EXPECT_TRUE(found.reached);
  EXPECT_NEAR(found.time, 2.5, 1e-14);
  EXPECT_NEAR(first_below({2}, {0}, 0.8).time, 0.4, 1e-14) << "it begins with 1";
  const Crossing never = first_below({1, 2}, {0.9, 0.8}, 0.8);
  EXPECT_FALSE(never.reached);
  EXPECT_EQ(never.time, 2);
}

}  // namespace
}  // namespace dpde::training
