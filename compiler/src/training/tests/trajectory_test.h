// SPDX-License-Identifier: Apache-2.0
// A task's tests, statistics and rates of growth on trajectories: the scene runs from the first frame of each run,
// other scenes beside it, and a quantity tells at every frame behind it how far it has gone astray.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/report/solve_report.h"
#include "training/tests/beside.h"
#include "training/tests/growth.h"
#include "training/tests/test_conditions.h"
#include "training/tests/trajectory_evaluator.h"

namespace dpde::training {

struct TrajectoryTest {
  std::string name, scene, file;
  model::Test::Kind kind = model::Test::Kind::number;
  std::vector<double> times;  // since the first frame
  std::vector<std::vector<double>>
      runs;  // the quantity of each run at each of these times; infinite from where a run has blown up
  std::vector<std::vector<double>> data;  // of a statistic: the quantity of the data themselves
  bool has_network = false;               // the scene
  bool made_data = false;                 // the scene made the data of `file`: what errors are against, no competitor
  bool is_named = true;                   // in the task; else a plain method that the tool adds
  std::string method_kind;                // how it takes derivatives in space
  // Of a spectrum, whose `runs` and `data` are the energies of its shells:
  std::size_t last_resolved = 0;                           // shell
  double unit = 0, noise = 0;                              // wave number of shell 1; see distance()
  double threshold = 0;                                    // of a correlation
  std::vector<driver::SolveReport> solves = {};            // those of all runs
  std::map<std::string, std::vector<double>> params = {};  // by name, of each run

  /// Over the times, of each run; and over the runs, at each time.
  std::vector<double> means() const { return means_of(runs); }
  std::vector<double> course() const { return course_of(runs); }
  /// What scenes are compared by, of each run: the mean over the times; of a correlation one over the time that it
  /// lasts.
  std::vector<double> errors() const;
  /// Whether run k of both is one run, by the parameters that both files tell.
  bool has_runs_of(const TrajectoryTest& other) const;
  static std::vector<double> means_of(const std::vector<std::vector<double>>& runs);
  static std::vector<double> course_of(const std::vector<std::vector<double>>& runs);
  /// Over the times, of each run.
  static std::vector<double> deviations_of(const std::vector<std::vector<double>>& runs);
};

/// With what the scenes beside it cost.
inline bool is_compared(const model::Test& test) {
  return !test.beside.empty() &&
         (test.kind == model::Test::Kind::number || test.kind == model::Test::Kind::correlation);
}

struct GrowthTest {
  std::string name, scene, file;
  std::vector<double> rates;  // of each run
};

struct MeanAndSpread {
  double mean = 0, spread = 0;  // the standard deviation, of a sample; not a number of a single one
};
MeanAndSpread mean_and_spread(const std::vector<double>& values);

/// What tests need beside the task's scene, and the scenes that have the tangents of their steps.
struct TestScenes {
  const TrainingScene& own;
  const SourceFile& source;
  std::vector<model::Test> tests, growths;
  std::unique_ptr<BesideScenes> beside;
  std::map<std::string, std::unique_ptr<GrowthScene>>
      growth_scenes;  // by name; none where no rate of growth is asked for

  /// null after errors, before a long training begins: files that do not fit, scenes that do not compile.
  static std::unique_ptr<TestScenes> open(const TrainingScene& own, const SourceFile& source,
                                          std::vector<model::Test> tests, std::vector<model::Test> growths,
                                          DiagnosticSink& sink);
  /// One more scene beside a test; false, and nothing is changed, after errors: it does not compile or does not fit.
  bool add(std::size_t test, const model::Test::Baseline& beside, DiagnosticSink& sink);
};

/// All tests and statistics, of the task's scene. Reports what is wrong with their files, which may have changed.
std::vector<TrajectoryTest> tests_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, DiagnosticSink& sink);
/// The conditions of each test, by its file; `knows_training`: the own scene is of the data that were learnt from.
std::vector<TestConditions> conditions_of_tests(const TestScenes& scenes, bool knows_training, DiagnosticSink& sink);
/// Of a scene beside a test.
TrajectoryTest test_beside(const TestScenes& scenes, std::size_t test, const model::Test::Baseline& beside,
                           const UnknownValues& values, const BatchOptions& options);
/// Of the scenes beside: by test, in the order of its line.
std::vector<std::vector<TrajectoryTest>> tests_beside(const TestScenes& scenes, const UnknownValues& values,
                                                      const BatchOptions& options);
/// Seconds that a processor works for a unit of time, as measured several times; not numbers where a run blows up.
struct TestCost {
  std::vector<double> samples;
  double least() const;
  double median() const;
};
struct CostTiming {
  int samples = 5;
  double seconds = 0.02;  // that each takes at least
};
/// Of the task's scene and then of those beside, one thread each, in turn: what slows the machine down for a while
/// slows all of them. By test, empty of a test with nothing beside it.
std::vector<std::vector<TestCost>> costs_of_tests(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, const CostTiming& timing,
                                                  DiagnosticSink& sink);

std::vector<GrowthTest> growths_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                const BatchOptions& options, DiagnosticSink& sink);
std::vector<std::vector<GrowthTest>> growths_beside(const TestScenes& scenes, const UnknownValues& values,
                                                    const BatchOptions& options);

}  // namespace dpde::training
