// SPDX-License-Identifier: Apache-2.0
// The tests of a task that learns, run with given values of what it learns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "interrupt.h"
#include "report/tests.h"
#include "report/training_chart.h"
#include "scene_output.h"
#include "train.h"
#include "training/plain_methods.h"

namespace dpde::tools {

namespace {

/// Of each trial and of the start; equal values are run once.
template <class Result, class Run>
void run_all(const TestedValues& values, Result& results, const Run& run) {
  for (const training::UnknownValues& trial : values.trials) results.trials.push_back(run(trial));
  results.start = values.trials[values.best] == values.start ? results.trials[values.best] : run(values.start);
}

/// Behind the scenes named: plain methods that suit their equations, and cheaper versions of the best of these.
void add_plain_methods(Job& job, const TestRun& run, const training::UnknownValues& found,
                       training::TestResults& tests) {
  training::PlainMethods more = training::plain_methods(run.scenes, tests.beside, &interrupt_flag());
  training::add_plain_methods(run.scenes, more, found, run.options, tests.beside);
  for (std::size_t k = 0; run.chart && k < more.left_out.size(); ++k)
    job.say(fmt::format("left out: {}\n", more.left_out[k]));
  if (interrupt_flag().load()) return;
  const auto costs = training::costs_of_tests(run.scenes, found, run.options, {}, job.sink());
  if (costs.size() != run.scenes.tests.size() || interrupt_flag().load()) return;
  training::add_cheaper_versions(run.scenes, costs, found, run.options, tests.beside);
}

/// Where no run of a test gives a number, as all of them blow up, there is nothing to judge. Of what lasts for a while,
/// as a correlation does, that is a number.
void fail_where_nothing_is_finite(Job& job, const training::TestScenes& scenes,
                                  const std::vector<training::TrajectoryTest>& tests) {
  if (job.failed()) return;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const training::TrajectoryTest& test = tests[i];
    const auto is_finite = [](double value) { return std::isfinite(value); };
    const bool lasts = test.kind == model::Test::Kind::correlation;
    if (lasts || test.runs.empty() || std::ranges::any_of(test.means(), is_finite)) continue;
    job.sink().report("run-failed", scenes.tests[i].quantity.origin.range,
                      {fmt::format("test {} is a finite number in none of the {} runs of {} with these values",
                                   test.name, test.runs.size(), test.file)},
                      "fewer steps of the test, a longer unroll of the training or a smaller step may help");
  }
}

/// Weights are the network's in all scenes: what is learnt stands above the file of weights that a scene beside names.
void tell_weights_not_used(Job& job, const training::TestScenes& scenes) {
  const model::Problem& own = *scenes.own.compiled->problem;
  std::set<std::string> told;
  for (const model::Test& test : scenes.tests) {
    for (const model::Test::Beside& beside : test.beside) {
      const model::Problem& problem = *scenes.beside->scene(beside).compiled->problem;
      for (const model::GivenWeights& given : problem.weights) {
        const auto is_it = [&](const model::Unknown& unknown) { return unknown.name == given.network; };
        const auto same = std::ranges::find(own.weights, given.network, &model::GivenWeights::network);
        const bool is_same = same != own.weights.end() && same->from.file == given.from.file;
        if (is_same || std::ranges::none_of(own.task->unknowns, is_it) ||
            !told.insert(problem.scene + " " + given.network).second)
          continue;
        job.say(
            fmt::format("warning: scene {} beside is tested with the weights of {} that task {} learns, not with "
                        "those of {}, which another network can have\n",
                        problem.scene, given.network, own.task->name, given.from.file));
      }
    }
  }
}

/// False where that is interrupted, and nothing is reported.
bool make_and_report(Job& job, const TestRun& run, const TestedValues& values, Json& json) {
  training::TestScenes& scenes = run.scenes;
  const training::UnknownValues& found = values.trials[values.best];
  training::TestResults tests{values.best};
  training::GrowthResults growths{values.best};
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
  if (interrupt_flag().load()) return false;
  tests.is_chart = run.chart.has_value();
  report::Report report = report::tests_report(tests);
  report.append(report::growths_report(growths));
  if (has_all) report.append(report::training_chart(scenes, tests));
  json.update(report.json);
  tell(job, report);
  fail_where_nothing_is_finite(job, scenes, tests.trials[tests.best]);
  return true;
}

}  // namespace

void run_tests(Job& job, const TestRun& run, const TestedValues& values, Json& json) {
  if (run.scenes.tests.empty() && run.scenes.growths.empty()) return;
  tell_weights_not_used(job, run.scenes);
  if (interrupt_flag().load() || !make_and_report(job, run, values, json))
    job.sink().report("run-failed", {}, {"stopped before all tests were run"}, run.if_stopped);
}

}  // namespace dpde::tools
