// SPDX-License-Identifier: Apache-2.0
// Common parts of the reports of tests.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "report/report.h"
#include "training/tests/test_results.h"

namespace dpde::report {

/// Results of one test: for each trial, for the start and for the compared scenes.
struct OneTest {
  std::vector<const training::TrajectoryTest*> trials;
  std::size_t best = 0;
  const training::TrajectoryTest* start = nullptr;
  const std::vector<training::TrajectoryTest>* beside = nullptr;
  std::vector<double> costs;  // of the task's scene and the compared ones; empty without a comparison
  const training::Investment* spent = nullptr;
  bool is_chart = false;

  const training::TrajectoryTest& found() const { return *trials[best]; }
  bool has_trials() const { return trials.size() > 1; }
  /// For each trial, the mean over runs and times.
  std::vector<double> means() const {
    std::vector<double> all;
    for (const training::TrajectoryTest* trial : trials) all.push_back(training::mean_and_spread(trial->means()).mean);
    return all;
  }
  training::MeanAndSpread at(std::size_t time) const {
    std::vector<double> all;
    for (const training::TrajectoryTest* trial : trials) all.push_back(trial->course()[time]);
    return training::mean_and_spread(all);
  }
};

/// "0.12 +- 0.01"; for a single value without spread.
std::string text_of(const training::MeanAndSpread& value);
/// "1 run", "5 runs"
std::string counted_runs(std::size_t runs);
/// null for a single value.
Json spread_json(double spread);
/// Mean and spread with the values, as JSON.
Json json_of(const std::vector<double>& values);
/// For a correlation: number of runs that stay above the threshold.
std::string staying_text(const training::TrajectoryTest& test);
/// Iterations and seconds of its solves, one line for each.
void say_solves(Report& report, const training::TrajectoryTest& test);
/// Reports the runs in which it is no longer finite.
void say_blow_up(Report& report, const training::TrajectoryTest& test);

/// Adds text, tables and pictures to `report`; returns the JSON of the test.
Json spectrum_report(Report& report, const OneTest& test);
Json correlation_report(Report& report, const OneTest& test);

}  // namespace dpde::report
