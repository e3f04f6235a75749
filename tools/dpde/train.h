// SPDX-License-Identifier: Apache-2.0
// dpde optimize of a task that learns from trajectories.
#pragma once

#include "driver/trainer.h"
#include "driver/trajectory_test.h"
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

/// Losses as tables and a curve, what was learnt as files, tests as tables and pictures: `found` with the best values, `start` with
/// those that the training began with. What --json says of the tests.
void write_trained(Job& job, const driver::Trainer& trainer);
Json report_tests(Job& job, const std::vector<driver::TrajectoryTest>& found, const std::vector<driver::TrajectoryTest>& start);

}  // namespace dpde::tools
