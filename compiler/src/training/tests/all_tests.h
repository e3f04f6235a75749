// SPDX-License-Identifier: Apache-2.0
// All tests of a task that learns, with given values of what it learns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "training/data/window_batches.h"
#include "training/tests/test_results.h"
#include "training/tests/trials.h"

namespace dpde::training {

/// What tests are run with: the values of each trial, and those that the best one began with.
struct TestedValues {
  std::size_t best = 0;
  std::vector<UnknownValues> trials = {};
  UnknownValues start = {};
  Investment spent = {};
};
struct TestRun {
  TestScenes& scenes;  // the plain methods are added to it
  BatchOptions options;
  bool only_named = false;          // tests have no plain methods beside them but those of the task
  std::optional<CostTiming> chart;  // beside all plain methods, timed so, as a chart
  bool knows_training = true;       // scenes.own is of the data that were learnt from
};
struct AllTests {
  TestResults tests;
  GrowthResults growths;
  bool has_plain_methods = false;     // beside those that are named
  std::vector<std::string> left_out;  // of these
};
/// nullopt where it is stopped.
std::optional<AllTests> run_tests(const TestRun& run, const TestedValues& values, DiagnosticSink& sink);

/// Where no run of a test gives a number, as all of them blow up, there is nothing to judge. Of what lasts for a while,
/// as a correlation does, that is a number.
void report_nothing_finite(const TestScenes& scenes, const std::vector<TrajectoryTest>& tests, DiagnosticSink& sink);

}  // namespace dpde::training
