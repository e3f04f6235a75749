// SPDX-License-Identifier: Apache-2.0
// dpde optimize for a task that learns from trajectories.
#pragma once

#include <optional>

#include "task_run.h"
#include "training/tests/all_tests.h"
#include "training/tests/trials.h"

namespace dpde::tools {

struct OptimizeOptions : TaskOptions {
  int iterations = 0;  // 0: the task's
  int epochs = 0;      // 0: the task's; only for training, as checkpoint_every
  bool resume = false;
  std::string checkpoint_every;
  bool only_named = false;                         // tests compare only with the plain methods named in the task
  std::optional<training::CostTiming> chart = {};  // compares with all plain methods, timed like this, as a chart
};

/// The job's source must be loaded. Returns nullopt after errors in the source.
std::optional<bool> learns_from_trajectories(Job& job);

/// At the start of the scene; networks never cause a step to be refused. Returns false after a diagnostic.
bool is_step_stable(Job& job, const TaskOptions& options, const TaskRun& run);

Json train(Job& job, const OptimizeOptions& options);

/// Runs and reports all tests. An interruption is an error, with `if_stopped` as advice on how to run the tests. A test
/// without a finite number in any of its runs is also an error.
void run_tests(Job& job, const training::TestRun& run, const training::TestedValues& values,
               const std::string& if_stopped, Json& json);

/// Writes losses as tables and a curve, and the best trial's values to files.
void write_trained(Job& job, const training::Trials& trials);

}  // namespace dpde::tools
