// SPDX-License-Identifier: Apache-2.0
// Checks for finite right-hand sides, with lengths around those of the internal strands.
#include "solve/operator/finite.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "solve_operators.h"

namespace dpde {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();

TEST(Finite, IsSaidOfEachPlace) {
  for (std::size_t size = 0; size < 50; ++size) {
    std::vector<double> values = test::arbitrary_values(static_cast<std::int64_t>(size), 5);
    EXPECT_TRUE(are_finite(values));
    EXPECT_EQ(factor_into_range(values), 1);
    for (std::size_t i = 0; i < size; ++i) {
      for (const double bad : {inf, -inf, nan}) {
        const double good = std::exchange(values[i], bad);
        EXPECT_FALSE(are_finite(values)) << size << " " << i;
        EXPECT_EQ(factor_into_range(values), 0) << size << " " << i;
        values[i] = good;
      }
    }
  }
}

TEST(Finite, FactorsBringTheLargestNearOne) {
  for (const double largest : {1e-300, -1e-310, 1e200, -1.7e308, 5e-324}) {
    for (std::size_t i = 0; i < 40; ++i) {
      std::vector<double> values(40, 0.0);
      values[i] = largest;
      const double factor = factor_into_range(values), size = std::abs(factor * largest);
      EXPECT_TRUE(size >= 0x1p-60 && size < 16) << largest << " " << i;
      EXPECT_EQ(std::exp2(std::ilogb(factor)), factor);
    }
  }
}

TEST(Finite, SumsAreThose) {
  for (std::size_t size = 0; size < 50; ++size) {
    const std::vector<double> values = test::arbitrary_values(static_cast<std::int64_t>(size), 7);
    double sum = 0, squares = 0;
    for (const double value : values) sum += value, squares += value * value;
    EXPECT_NEAR(sums_of(values).sum, sum, 1e-13);
    EXPECT_NEAR(sums_of(values).squares, squares, 1e-13);
  }
}

}  // namespace
}  // namespace dpde
