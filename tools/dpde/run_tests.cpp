// SPDX-License-Identifier: Apache-2.0
// The tests of a task that learns, run with given values of what it learns.
#include <fmt/format.h>

#include <algorithm>

#include "interrupt.h"
#include "train.h"
#include "training/plain_methods.h"
#include "training_chart.h"

namespace dpde::tools {

namespace {

/// Of each trial and of the start; equal values are run once.
template <class Result, class Run>
void run_all(const TestedValues& values, Result& results, const Run& run) {
  for (const training::UnknownValues& trial : values.trials) results.trials.push_back(run(trial));
  results.start = values.trials[values.best] == values.start ? results.trials[values.best] : run(values.start);
}

/// Behind the scenes named: plain methods that suit their equations, and cheaper versions of the best of these.
void add_plain_methods(Job& job, const TestRun& run, const training::UnknownValues& found, TestResults& tests) {
  const training::PlainMethods more = training::plain_methods(run.scenes, tests.beside, &interrupt_flag());
  for (std::size_t k = 0; run.chart && k < more.left_out.size(); ++k)
    job.say(fmt::format("left out: {}\n", more.left_out[k]));
  training::add_plain_methods(run.scenes, more, found, run.options, tests.beside);
  if (interrupt_flag().load()) return;
  const auto costs = training::costs_of_tests(run.scenes, found, run.options, {}, job.sink());
  if (costs.size() != run.scenes.tests.size() || interrupt_flag().load()) return;
  training::add_cheaper_versions(run.scenes, costs, found, run.options, tests.beside);
}

}  // namespace

void run_tests(Job& job, const TestRun& run, const TestedValues& values, Json& json) {
  training::TestScenes& scenes = run.scenes;
  const training::UnknownValues& found = values.trials[values.best];
  TestResults tests{values.best};
  GrowthResults growths{values.best};
  run_all(values, tests, [&](const training::UnknownValues& x) {
    return training::tests_on_trajectories(scenes, x, run.options, job.sink());
  });
  run_all(values, growths, [&](const training::UnknownValues& x) {
    return training::growths_on_trajectories(scenes, x, run.options, job.sink());
  });
  tests.spent = values.spent;
  tests.conditions = training::conditions_of_tests(scenes, run.knows_training, job.sink());
  tests.beside = training::tests_beside(scenes, found, run.options);
  growths.beside = training::growths_beside(scenes, found, run.options);
  const bool has_all = !run.only_named && std::ranges::any_of(scenes.tests, training::is_compared);
  if (has_all && !interrupt_flag().load()) add_plain_methods(job, run, found, tests);
  if (!interrupt_flag().load())
    tests.costs =
        training::costs_of_tests(scenes, found, run.options, run.chart.value_or(training::CostTiming{}), job.sink());
  if (interrupt_flag().load()) return;
  tests.is_chart = run.chart.has_value();
  report_tests(job, tests, json);
  report_growths(job, growths, json);
  if (has_all) write_training_chart(job, scenes, tests, json);
}

}  // namespace dpde::tools
