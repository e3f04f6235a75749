// SPDX-License-Identifier: Apache-2.0
#include "training/tests/all_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "training/tests/plain_methods.h"

namespace dpde::training {

namespace {

bool is_stopped(const TestRun& run) { return run.options.stop != nullptr && run.options.stop->load(); }

/// Runs the tests for each trial and for the start; equal values are run once.
template <class Result, class Run>
void run_all(const TestedValues& values, Result& results, const Run& run) {
  for (const UnknownValues& trial : values.trials) results.trials.push_back(run(trial));
  results.start = values.trials[values.best] == values.start ? results.trials[values.best] : run(values.start);
}

/// Adds plain methods suited to the equations after the named scenes, and cheaper versions of the best ones.
void add_all_methods(const TestRun& run, const UnknownValues& found, AllTests& all, DiagnosticSink& sink) {
  std::vector<std::vector<TrajectoryTest>>& beside = all.tests.beside;
  PlainMethods more = plain_methods(run.scenes, beside, run.options.stop);
  add_plain_methods(run.scenes, more, found, run.options, beside);
  all.left_out = std::move(more.left_out);
  if (is_stopped(run)) return;
  const auto costs = costs_of_tests(run.scenes, found, run.options, {}, sink);
  if (costs.size() != run.scenes.tests.size() || is_stopped(run)) return;
  add_cheaper_versions(run.scenes, costs, found, run.options, beside);
}

}  // namespace

std::optional<AllTests> run_tests(const TestRun& run, const TestedValues& values, DiagnosticSink& sink) {
  TestScenes& scenes = run.scenes;
  const UnknownValues& found = values.trials[values.best];
  AllTests all{{values.best}, {values.best}};
  run_all(values, all.tests,
          [&](const UnknownValues& x) { return tests_on_trajectories(scenes, x, run.options, sink); });
  run_all(values, all.growths,
          [&](const UnknownValues& x) { return growths_on_trajectories(scenes, x, run.options, sink); });
  all.tests.spent = values.spent;
  all.tests.conditions = conditions_of_tests(scenes, run.knows_training, sink);
  all.tests.beside = tests_beside(scenes, found, run.options);
  all.growths.beside = growths_beside(scenes, found, run.options);
  all.has_plain_methods = !run.only_named && std::ranges::any_of(scenes.tests, is_compared);
  if (all.has_plain_methods && !is_stopped(run)) add_all_methods(run, found, all, sink);
  if (!is_stopped(run))
    all.tests.costs = costs_of_tests(scenes, found, run.options, run.chart.value_or(CostTiming{}), sink);
  if (is_stopped(run)) return std::nullopt;
  all.tests.is_chart = run.chart.has_value();
  return all;
}

void report_nothing_finite(const TestScenes& scenes, const std::vector<TrajectoryTest>& tests, DiagnosticSink& sink) {
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const TrajectoryTest& test = tests[i];
    const auto is_finite = [](double value) { return std::isfinite(value); };
    const bool lasts = test.kind == model::Test::Kind::correlation;
    if (lasts || test.runs.empty() || std::ranges::any_of(test.means(), is_finite)) continue;
    sink.report("run-failed", scenes.tests[i].quantity.origin.range,
                {fmt::format("test {} is a finite number in none of the {} runs of {} with these values", test.name,
                             test.runs.size(), test.file)},
                "fewer steps of the test, a longer unroll of the training or a smaller step may help");
  }
}

}  // namespace dpde::training
