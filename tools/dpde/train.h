// SPDX-License-Identifier: Apache-2.0
// dpde optimize of a task that learns from trajectories.
#pragma once

#include <optional>

#include "task_run.h"
#include "training/tests/all_tests.h"
#include "training/tests/trials.h"

namespace dpde::tools {

struct OptimizeOptions : TaskOptions {
  int iterations = 0;  // 0: the task's
  int epochs = 0;      // 0: the task's; of training alone, as checkpoint_every
  bool resume = false;
  std::string checkpoint_every;
  bool only_named = false;                         // tests have no plain methods beside them but those of the task
  std::optional<training::CostTiming> chart = {};  // beside all plain methods, timed so, as a chart
};

/// The job's source is loaded. nullopt after the errors of a source that is wrong.
std::optional<bool> learns_from_trajectories(Job& job);

/// As the scene begins; networks change no step that is refused. False after a diagnostic.
bool is_step_stable(Job& job, const TaskOptions& options, const TaskRun& run);

Json train(Job& job, const OptimizeOptions& options);

/// Runs all tests and reports them, unless that is interrupted, which is an error that says `if_stopped`: how these
/// tests are run after all. An error is also a test that has a finite number in none of its runs.
void run_tests(Job& job, const training::TestRun& run, const training::TestedValues& values,
               const std::string& if_stopped, Json& json);

/// Losses as tables and a curve, what the best trial has learnt as files.
void write_trained(Job& job, const training::Trials& trials);

}  // namespace dpde::tools
