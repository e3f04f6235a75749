// SPDX-License-Identifier: Apache-2.0
// Equal error and equal cost, interpolated between plain schemes.
#include "analysis/certificate/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dpde::analysis {
namespace {

/// error = 1/cost^2: a straight line in logarithms. One scheme is more expensive and worse than another, one blows up.
const std::vector<CostAndError> schemes{{"c", 4, 1.0 / 16},
                                        {"a", 1, 1},
                                        {"worse", 3, 0.5},
                                        {"b", 2, 0.25},
                                        {"blown", 8, std::numeric_limits<double>::infinity()}};

TEST(Comparison, LeavesOutWhatIsDearerAndWorse) {
  const std::vector<CostAndError> best = best_of(schemes);
  ASSERT_EQ(best.size(), 3U);
  EXPECT_EQ(best[0].scene + best[1].scene + best[2].scene, "abc");
}

TEST(Comparison, IsExactOnALineOfLogarithms) {
  for (const double cost : {1.0, 1.3, 2.0, 2.7, 4.0}) {
    const Equal at_error = cost_of_equal_error(schemes, 1 / (cost * cost)),
                at_cost = error_of_equal_cost(schemes, cost);
    EXPECT_EQ(at_error.kind, Equal::Kind::found) << cost;
    EXPECT_EQ(at_cost.kind, Equal::Kind::found) << cost;
    EXPECT_NEAR(at_error.value, cost, 1e-14 * cost);
    EXPECT_NEAR(at_cost.value, 1 / (cost * cost), 1e-14);
  }
  EXPECT_EQ(cost_of_equal_error(schemes, 0.1).from, "b");
  EXPECT_EQ(cost_of_equal_error(schemes, 0.1).to, "c");
}

TEST(Comparison, SaysWhereItEnds) {
  EXPECT_EQ(cost_of_equal_error(schemes, 0.06).kind, Equal::Kind::beyond_all);
  EXPECT_EQ(cost_of_equal_error(schemes, 1.1).kind, Equal::Kind::within_all);
  EXPECT_EQ(cost_of_equal_error(schemes, 1.1).value, 1);
  EXPECT_EQ(error_of_equal_cost(schemes, 0.9).kind, Equal::Kind::beyond_all);
  EXPECT_EQ(error_of_equal_cost(schemes, 4.1).kind, Equal::Kind::within_all);
  EXPECT_EQ(error_of_equal_cost(schemes, 4.1).value, 1.0 / 16);
  EXPECT_EQ(cost_of_equal_error(schemes, std::nan("")).kind, Equal::Kind::beyond_all);
  EXPECT_EQ(cost_of_equal_error({}, 1).kind, Equal::Kind::beyond_all);
  const std::vector<CostAndError> one{{"a", 2, 3}};
  EXPECT_EQ(cost_of_equal_error(one, 3).value, 2);
  EXPECT_EQ(error_of_equal_cost(one, 2).value, 3);
}

TEST(Comparison, BreakEvenIsWhatWasSpentOverWhatARunSaves) {
  const Equal equal{Equal::Kind::found, 3, "a", "b"}, cheapest{Equal::Kind::within_all, 3, "a", "a"},
      none{Equal::Kind::beyond_all, 0, "", ""};
  const BreakEven even = break_even(equal, 1, 5, 100);
  EXPECT_EQ(even.kind, BreakEven::Kind::after);
  EXPECT_EQ(even.runs, 10) << "each run of 5 units saves 10 s";
  EXPECT_EQ(break_even(cheapest, 1, 5, 100).runs, 10);
  EXPECT_EQ(break_even(equal, 3, 5, 100).kind, BreakEven::Kind::never);
  EXPECT_EQ(break_even(equal, 4, 5, 0).kind, BreakEven::Kind::never);
  EXPECT_EQ(break_even(none, 1, 5, 100).kind, BreakEven::Kind::unknown);
}

}  // namespace
}  // namespace dpde::analysis
