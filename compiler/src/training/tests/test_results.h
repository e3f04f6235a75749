// SPDX-License-Identifier: Apache-2.0
// What the tests of a task that learns have given: of each trial, of the start, and of the scenes beside.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "training/tests/test_conditions.h"
#include "training/tests/trajectory_test.h"

namespace dpde::training {

/// Seconds that processors worked; not a number where that is not known.
struct Investment {
  double data_s = std::numeric_limits<double>::quiet_NaN(), training_s = std::numeric_limits<double>::quiet_NaN();
  int trials = 1;  // each of which took training_s in the mean
};
/// The tests of each trial with its best values, with those that the best trial began with, and of the scenes beside.
struct TestResults {
  std::size_t best = 0;
  std::vector<std::vector<TrajectoryTest>> trials = {};
  std::vector<TrajectoryTest> start = {};
  std::vector<std::vector<TrajectoryTest>> beside = {};
  std::vector<std::vector<TestCost>> costs = {};
  std::vector<TestConditions> conditions = {};
  Investment spent = {};
  bool is_chart = false;  // of many plain methods: without their courses over time
};
struct GrowthResults {
  std::size_t best = 0;
  std::vector<std::vector<GrowthTest>> trials = {};
  std::vector<GrowthTest> start = {};
  std::vector<std::vector<GrowthTest>> beside = {};
};

}  // namespace dpde::training
