// SPDX-License-Identifier: Apache-2.0
// Ratios over runs and seeds, with confidence intervals.
#include "analysis/certificate/paired_ratio.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace dpde::analysis {
namespace {

/// From tables of Student's distribution.
TEST(PairedRatio, KnowsStudentsQuantiles) {
  EXPECT_NEAR(student_95(1), 12.7062, 1e-4);
  EXPECT_NEAR(student_95(2), 4.30265, 1e-5);
  EXPECT_NEAR(student_95(4), 2.77645, 1e-5);
  EXPECT_NEAR(student_95(15), 2.13145, 1e-5);
  EXPECT_NEAR(student_95(1e6), 1.95996, 1e-5);
}

/// Ratios of 1/2 and 2: the logarithms are -log 2 and log 2, the standard error of their mean is log 2, with one degree
/// of freedom.
TEST(PairedRatio, IsAGeometricMeanWithStudentsInterval) {
  const PairedRatio found = paired_ratio({{0.5, 2}});
  EXPECT_NEAR(found.mean, 1, 1e-15);
  EXPECT_NEAR(found.high, std::exp(12.7062 * std::log(2)), 1e-3 * found.high);
  EXPECT_NEAR(found.low * found.high, 1, 1e-12);
  EXPECT_EQ(found.runs, 2);
  EXPECT_EQ(found.seeds, 1);
}

TEST(PairedRatio, HasNoIntervalOfOneRunAndOneSeed) {
  const PairedRatio found = paired_ratio({{3}});
  EXPECT_NEAR(found.mean, 3, 1e-15);
  EXPECT_FALSE(found.has_interval());
}

TEST(PairedRatio, LeavesOutRunsThatHaveNoneForAllSeeds) {
  const double none = std::numeric_limits<double>::quiet_NaN(), blown = std::numeric_limits<double>::infinity();
  const PairedRatio found = paired_ratio({{2, none, 8, 1}, {2, 5, 8, blown}});
  EXPECT_EQ(found.runs, 2);
  EXPECT_NEAR(found.mean, 4, 1e-15);
  EXPECT_EQ(paired_ratio({{none}}).runs, 0);
}

/// Random runs and seeds: the interval contains the true ratio in at least 95 of 100 cases.
TEST(PairedRatio, HoldsTheTruth) {
  std::mt19937_64 bits(7);
  std::normal_distribution<double> normal;
  for (const auto& [runs, seeds, of_runs, of_seeds] : {std::tuple(5, 1, 0.4, 0.0), std::tuple(5, 3, 0.3, 0.3),
                                                       std::tuple(16, 3, 0.4, 0.1), std::tuple(2, 4, 0.0, 0.2)}) {
    int held = 0;
    constexpr int cases = 2000;
    for (int i = 0; i < cases; ++i) {
      std::vector<double> run(runs);
      for (double& value : run) value = of_runs * normal(bits);
      std::vector<std::vector<double>> ratios;
      for (int k = 0; k < seeds; ++k) {
        const double seed = of_seeds * normal(bits);
        std::vector<double>& all = ratios.emplace_back();
        for (const double value : run) all.push_back(1.5 * std::exp(value + seed + 0.05 * normal(bits)));
      }
      const PairedRatio found = paired_ratio(ratios);
      held += found.low <= 1.5 && 1.5 <= found.high ? 1 : 0;
    }
    EXPECT_GE(held, 0.935 * cases) << runs << " runs, " << seeds << " seeds";
  }
}

}  // namespace
}  // namespace dpde::analysis
