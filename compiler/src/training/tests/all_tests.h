// SPDX-License-Identifier: Apache-2.0
// All tests of a learning task, with given values of the unknowns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "training/data/window_batches.h"
#include "training/tests/test_results.h"
#include "training/tests/trials.h"

namespace dpde::training {

/// Values to test: those of each trial, and the start of the best trial.
struct TestedValues {
  std::size_t best = 0;
  std::vector<UnknownValues> trials = {};
  UnknownValues start = {};
  Investment spent = {};
};
struct TestRun {
  TestScenes& scenes;  // plain methods are added to it
  BatchOptions options;
  bool only_named = false;          // tests are compared only with the plain methods that the task names
  std::optional<CostTiming> chart;  // if set: makes a chart with all plain methods and these timings
  bool knows_training = true;       // scenes.own has the training data
};
struct AllTests {
  TestResults tests;
  GrowthResults growths;
  bool has_plain_methods = false;     // in addition to the named ones
  std::vector<std::string> left_out;  // plain methods that were left out
};
/// Returns nullopt if it was stopped.
std::optional<AllTests> run_tests(const TestRun& run, const TestedValues& values, DiagnosticSink& sink);

/// Reports tests without a finite result in any run, as when all blow up. A duration, as of a correlation, is always
/// finite.
void report_nothing_finite(const TestScenes& scenes, const std::vector<TrajectoryTest>& tests, DiagnosticSink& sink);

}  // namespace dpde::training
