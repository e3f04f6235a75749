// SPDX-License-Identifier: Apache-2.0
// Tests, statistics and growth rates of a task on trajectories. The scene and the compared scenes run from the first
// frame of each run; a quantity at every later frame measures the error.
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
  std::vector<double> times;              // since the first frame
  std::vector<std::vector<double>> runs;  // the quantity for each run at these times; infinite once a run has blown up
  std::vector<std::vector<double>> data;  // for a statistic: the quantity of the data themselves
  bool has_network = false;               // the scene has one
  bool made_data = false;                 // the scene made the data of `file`: it is the reference, not a competitor
  bool is_named = true;                   // named in the task; else a plain method added automatically
  std::string method_kind;                // its spatial discretisation
  // For a spectrum, whose `runs` and `data` are the energies of its shells:
  std::size_t last_resolved = 0;                           // last resolved shell
  double unit = 0, noise = 0;                              // wave number of shell 1; see distance()
  double threshold = 0;                                    // for a correlation
  std::vector<driver::SolveReport> solves = {};            // over all runs
  std::map<std::string, std::vector<double>> params = {};  // by name, for each run

  /// Means over the times for each run; and over the runs at each time.
  std::vector<double> means() const { return means_of(runs); }
  std::vector<double> course() const { return course_of(runs); }
  /// Measure for comparing scenes, for each run: mean over the times; for a correlation, one over its duration.
  std::vector<double> errors() const;
  /// Whether run k is the same in both, by the parameters that both files have.
  bool has_runs_of(const TrajectoryTest& other) const;
  static std::vector<double> means_of(const std::vector<std::vector<double>>& runs);
  static std::vector<double> course_of(const std::vector<std::vector<double>>& runs);
  /// Deviations over the times, for each run.
  static std::vector<double> deviations_of(const std::vector<std::vector<double>>& runs);
};

/// Whether the test is compared with the cost of other scenes.
inline bool is_compared(const model::Test& test) {
  return !test.beside.empty() &&
         (test.kind == model::Test::Kind::number || test.kind == model::Test::Kind::correlation);
}

struct GrowthTest {
  std::string name, scene, file;
  std::vector<double> rates;  // for each run
};

struct MeanAndSpread {
  double mean = 0, spread = 0;  // sample standard deviation; NaN for a single value
};
MeanAndSpread mean_and_spread(const std::vector<double>& values);

/// Compared scenes of the tests, and scenes with tangents of their steps.
struct TestScenes {
  const TrainingScene& own;
  const SourceFile& source;
  std::vector<model::Test> tests, growths;
  std::unique_ptr<BesideScenes> beside;
  std::map<std::string, std::unique_ptr<GrowthScene>> growth_scenes;  // by name; empty without growth rates

  /// Returns null after errors, found before a long training begins: unsuitable files, scenes that do not compile.
  static std::unique_ptr<TestScenes> open(const TrainingScene& own, const SourceFile& source,
                                          std::vector<model::Test> tests, std::vector<model::Test> growths,
                                          DiagnosticSink& sink);
  /// Adds a scene to a test. Returns false after errors, with nothing changed: it does not compile or does not fit.
  bool add(std::size_t test, const model::Test::Baseline& beside, DiagnosticSink& sink);
};

/// All tests and statistics of the task's scene. Reports errors of their files, which may have changed.
std::vector<TrajectoryTest> tests_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, DiagnosticSink& sink);
/// Conditions of each test, by its file. `knows_training`: the own scene has the training data.
std::vector<TestConditions> conditions_of_tests(const TestScenes& scenes, bool knows_training, DiagnosticSink& sink);
/// For one compared scene.
TrajectoryTest test_beside(const TestScenes& scenes, std::size_t test, const model::Test::Baseline& beside,
                           const UnknownValues& values, const BatchOptions& options);
/// For all compared scenes: by test, in the order of its line.
std::vector<std::vector<TrajectoryTest>> tests_beside(const TestScenes& scenes, const UnknownValues& values,
                                                      const BatchOptions& options);
/// CPU seconds for a unit of time, measured several times; NaN if a run blows up.
struct TestCost {
  std::vector<double> samples;
  double least() const;
  double median() const;
};
struct CostTiming {
  int samples = 5;
  double seconds = 0.02;  // minimum duration of each
};
/// For the task's scene and then the compared ones, on one thread each and interleaved, so that a temporary slow-down
/// of the machine affects all of them. By test; empty for a test without comparisons.
std::vector<std::vector<TestCost>> costs_of_tests(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, const CostTiming& timing,
                                                  DiagnosticSink& sink);

std::vector<GrowthTest> growths_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                const BatchOptions& options, DiagnosticSink& sink);
std::vector<std::vector<GrowthTest>> growths_beside(const TestScenes& scenes, const UnknownValues& values,
                                                    const BatchOptions& options);

}  // namespace dpde::training
