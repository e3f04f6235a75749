// SPDX-License-Identifier: Apache-2.0
// dpde optimize of a task that learns from trajectories.
#pragma once

#include "driver/trajectory_test.h"
#include "driver/trials.h"
#include "task_run.h"

namespace dpde::tools {

struct OptimizeOptions : TaskOptions {
  int iterations = 0;  // 0: the task's
  int epochs = 0;      // 0: the task's; of training alone, as checkpoint_every
  bool resume = false;
  std::string checkpoint_every;
};

/// The job's source is loaded. False too when the source is wrong: whoever compiles it says so.
bool learns_from_trajectories(Job& job);

Json train(Job& job, const OptimizeOptions& options);

/// The tests of each trial with its best values, and with those that the best trial began with.
struct TestResults {
  std::vector<std::vector<driver::TrajectoryTest>> trials;
  std::size_t best = 0;
  std::vector<driver::TrajectoryTest> start;
};

/// Losses as tables and a curve, what the best trial has learnt as files.
void write_trained(Job& job, const driver::Trials& trials);
/// Tables and pictures, and what --json says.
Json report_tests(Job& job, const TestResults& results);

}  // namespace dpde::tools
