// SPDX-License-Identifier: Apache-2.0
// dpde optimize of a task that learns from trajectories.
#pragma once

#include <optional>

#include "task_run.h"
#include "training/test_results.h"
#include "training/trajectory_test.h"
#include "training/trials.h"

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

/// What tests are run with: the values of each trial, and those that the best one began with.
struct TestedValues {
  std::size_t best = 0;
  std::vector<training::UnknownValues> trials = {};
  training::UnknownValues start = {};
  training::Investment spent = {};
};
struct TestRun {
  training::TestScenes& scenes;  // the plain methods are added to it
  training::BatchOptions options;
  bool only_named = false;                    // see OptimizeOptions
  std::optional<training::CostTiming> chart;  // see there
  bool knows_training = true;                 // scenes.own is of the data that were learnt from
  std::string if_stopped = {};                // how these tests are run after all
};
/// Runs all tests and reports them, unless that is interrupted, which is an error. So is a test that has a finite
/// number in none of its runs.
void run_tests(Job& job, const TestRun& run, const TestedValues& values, Json& json);

/// Losses as tables and a curve, what the best trial has learnt as files.
void write_trained(Job& job, const training::Trials& trials);

}  // namespace dpde::tools
