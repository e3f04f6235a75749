// SPDX-License-Identifier: Apache-2.0
// Test results of a learning task: for each trial, for the start, and for the scenes compared.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "training/tests/test_conditions.h"
#include "training/tests/trajectory_test.h"

namespace dpde::training {

/// CPU seconds; NaN if unknown.
struct Investment {
  double data_s = std::numeric_limits<double>::quiet_NaN(), training_s = std::numeric_limits<double>::quiet_NaN();
  int trials = 1;  // training_s is the mean over these
};
/// Tests of each trial's best values, of the best trial's start, and of the scenes compared.
struct TestResults {
  std::size_t best = 0;
  std::vector<std::vector<TrajectoryTest>> trials = {};
  std::vector<TrajectoryTest> start = {};
  std::vector<std::vector<TrajectoryTest>> beside = {};
  std::vector<std::vector<TestCost>> costs = {};
  std::vector<TestConditions> conditions = {};
  Investment spent = {};
  bool is_chart = false;  // with many plain methods, without their time series
};
struct GrowthResults {
  std::size_t best = 0;
  std::vector<std::vector<GrowthTest>> trials = {};
  std::vector<GrowthTest> start = {};
  std::vector<std::vector<GrowthTest>> beside = {};
};

}  // namespace dpde::training
