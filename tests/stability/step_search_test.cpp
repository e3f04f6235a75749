// SPDX-License-Identifier: Apache-2.0
#include "stability/step/step_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace dpde::stability {
namespace {

struct Row {
  const char* name;
  double (*f)(double);
  double root;
};

TEST(LeastPositive, IsFoundInFewLooks) {
  const Row rows[] = {
      {"a line", [](double x) { return x - 1; }, 1},
      {"a kink", [](double x) { return std::max(0.0, 7 * (x - 1)); }, 1},
      {"a kink that bends", [](double x) { return std::max(-1e-4, std::exp(9 * (x - 1)) - 1); }, 1},
      {"two eigenvalues that meet", [](double x) { return x > 1 ? std::sqrt(x * x - 1) : 0; }, 1},
      // ln |R(i y)| of the method of Runge and Kutta of order 4
      {"rk4", [](double y) { return 0.5 * std::log(1 - std::pow(y, 6) / 72 + std::pow(y, 8) / 576); }, std::sqrt(8.0)},
      {"near the end", [](double x) { return x - 1.19999; }, 1.19999},
      {"noise below", [](double x) { return x > 1 ? x - 1 : -1e-3 * std::abs(std::sin(1e3 * x)); }, 1},
  };
  constexpr double precision = 1e-4;
  constexpr int most_looks = 20;  // by halves 14, which lines need not
  for (const Row& row : rows) {
    int looks = 0;
    const auto f = [&](double x) { return ++looks, row.f(x); };
    const double found = least_positive(f, 1.2 * row.root, precision);
    EXPECT_GT(row.f(found), 0) << row.name;
    EXPECT_NEAR(found, row.root, precision * found) << row.name;
    EXPECT_LE(looks, most_looks) << row.name;
  }
  EXPECT_EQ(least_positive([](double) { return 0.0; }, 1, precision), 0);
  EXPECT_EQ(least_positive([](double) { return std::nan(""); }, 1, precision), 0);
}

/// A guess changes the number of tried steps, not the result.
TEST(LargestStable, IsTheSameWhateverIsGuessed) {
  constexpr double limit = 0.7, precision = 1e-3;
  struct Guess {
    double (*begins_to_grow)(double);
    int most_asked;
  };
  const Guess rows[] = {
      {nullptr, 20},
      {[](double) { return 0.70001; }, 2},
      {[](double unstable) { return unstable > 2 ? 2.0 : 0.70001; }, 3},  // another one grows first
      {[](double) { return 0.69; }, 12},                                  // too low
      {[](double unstable) { return 0.999 * unstable; }, 30},             // what is followed never ends
      {[](double) { return 0.0; }, 20},
      {[](double) { return std::nan(""); }, 20},
      {[](double unstable) { return 2 * unstable; }, 20},
  };
  for (const Guess& row : rows) {
    int asked = 0;
    const auto is_stable = [&](double step) { return ++asked, step <= limit; };
    StepSearch search{is_stable, precision, 1e-3, {}};
    if (row.begins_to_grow != nullptr) search.begins_to_grow = row.begins_to_grow;
    const double found = largest_stable(search, 100);
    EXPECT_LE(found, limit);
    EXPECT_GE(found, (1 - precision) * limit);
    EXPECT_LE(asked, row.most_asked);
  }
  EXPECT_EQ(largest_stable({[](double) { return false; }, precision, 1e-3, {}}, 1), 0);
}

TEST(FirstUnstable, IsLookedForUpwards) {
  const auto is_stable = [](double step) { return step < 0.3 || step > 0.5; };  // a window
  EXPECT_EQ(first_unstable(is_stable, 0.1, 1), 0.4);
  EXPECT_EQ(first_unstable(is_stable, 0, 1), 0);
  EXPECT_EQ(first_unstable([](double) { return true; }, 0.1, 1), 0);
}

}  // namespace
}  // namespace dpde::stability
