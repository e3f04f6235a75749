// SPDX-License-Identifier: Apache-2.0
// What the reports of tests share.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "report/report.h"
#include "training/tests/test_results.h"

namespace dpde::report {

/// What one test says of each trial, of the start and of the scenes beside.
struct OneTest {
  std::vector<const training::TrajectoryTest*> trials;
  std::size_t best = 0;
  const training::TrajectoryTest* start = nullptr;
  const std::vector<training::TrajectoryTest>* beside = nullptr;
  std::vector<double> costs;  // of the task's scene and those beside; empty where nothing is compared
  const training::Investment* spent = nullptr;
  bool is_chart = false;

  const training::TrajectoryTest& found() const { return *trials[best]; }
  bool has_trials() const { return trials.size() > 1; }
  /// Of the means over runs and times, over the trials.
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

/// "0.12 +- 0.01"; of one number it alone.
std::string text_of(const training::MeanAndSpread& value);
/// "1 run", "5 runs"
std::string counted_runs(std::size_t runs);
/// null of one number.
Json spread_json(double spread);
/// With its numbers, as JSON.
Json json_of(const std::vector<double>& values);
/// Of a correlation: how many runs stay above the threshold.
std::string staying_text(const training::TrajectoryTest& test);
/// Iterations and seconds of the solves of its runs, a line each.
void say_solves(Report& report, const training::TrajectoryTest& test);
/// The runs in which it is no longer finite.
void say_blow_up(Report& report, const training::TrajectoryTest& test);

/// Words, tables and pictures in `report`, and the JSON of the test.
Json spectrum_report(Report& report, const OneTest& test);
Json correlation_report(Report& report, const OneTest& test);

}  // namespace dpde::report
