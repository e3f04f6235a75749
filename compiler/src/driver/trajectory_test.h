// SPDX-License-Identifier: Apache-2.0
// A task's test on trajectories: the scene runs from the first frame of each run, and a quantity tells at every frame behind it how far
// it has gone astray.
#pragma once

#include <string>
#include <vector>

#include "driver/window_batches.h"

namespace dpde::driver {

struct TrajectoryTest {
  std::string name, file;
  std::vector<double> times;             // since the first frame
  std::vector<std::vector<double>> runs; // the quantity of each run at each of these times; infinite from where a run has blown up

  /// Over the times, of each run; and over the runs, at each time.
  std::vector<double> means() const;
  std::vector<double> course() const;
};

struct MeanAndSpread {
  double mean = 0, spread = 0;  // the standard deviation, of a sample; 0 of a single number
};
MeanAndSpread mean_and_spread(const std::vector<double>& values);

/// Whether the files of all tests are there and fit, before a long training begins. Reports what is wrong with them.
bool check_tests(const TrainingScene& scene, const SourceFile& source, DiagnosticSink& sink);

/// All tests on trajectories of the scene's task, with the unknowns x. Reports what is wrong with their files.
std::vector<TrajectoryTest> tests_on_trajectories(const TrainingScene& scene, const Eigen::VectorXd& x, const SourceFile& source, const BatchOptions& options, DiagnosticSink& sink);

}  // namespace dpde::driver
