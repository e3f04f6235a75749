// SPDX-License-Identifier: Apache-2.0
#include "training/tests/trajectory_test.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "chart/sweep.h"
#include "dpde/runtime/team.h"
#include "model/build.h"
#include "support/assert.h"

namespace dpde::training {

namespace {

using Runs = std::vector<std::vector<double>>;
using Visit = std::function<std::vector<double>(TrajectoryEvaluator&, int run)>;

/// Whether the scene made the runs of its file. All runs are checked, since one may be at rest, which any scheme
/// reproduces.
bool made_data_of(const TrainingScene& scene, const UnknownValues& values, const BatchOptions& options) {
  TrajectoryEvaluator evaluator(scene, scene.trajectories, values, options);
  bool made = true;
  for (int run = 0; made && run < std::ssize(scene.trajectories.runs); ++run) made = evaluator.makes_data(run);
  return made;
}

/// Whether the test reads data; otherwise it measures no error.
bool reads_data(const model::Problem& problem, const model::Test& test) {
  if (test.kind != model::Test::Kind::number) return true;
  return any_part(test.quantity.value, [&](const model::Expr& e) {
    const auto* field = as<model::Field>(e);
    const auto& data = problem.task->data;
    return field != nullptr && std::ranges::find(data, field->name, &model::Datum::name) != data.end();
  });
}

/// Calls `visit` for every run, on all threads. `met`: notes on the solves of all runs.
Runs over_runs(const TrainingScene& scene, const files::Trajectories& on, const UnknownValues& x,
               const BatchOptions& options, const Visit& visit, std::deque<SolveNote>* met = nullptr) {
  const auto runs = static_cast<std::int64_t>(on.runs.size());
  std::deque<TrajectoryEvaluator> evaluators;
  for (std::int64_t t = 0; t < std::clamp<std::int64_t>(options.threads, 1, runs); ++t)
    evaluators.emplace_back(scene, on, x, options);
  Runs values(on.runs.size());
  Team(static_cast<int>(evaluators.size())).run(runs, [&](std::int64_t run, int thread) {
    values[static_cast<std::size_t>(run)] = visit(evaluators[static_cast<std::size_t>(thread)], static_cast<int>(run));
  });
  for (const TrajectoryEvaluator& evaluator : evaluators) {
    if (met == nullptr) break;
    const std::deque<SolveNote> notes = evaluator.solve_notes();
    met->insert(met->end(), notes.begin(), notes.end());
  }
  return values;
}

bool fits(const model::Test& test, const files::Trajectories& on, DiagnosticSink& sink) {
  if (looks_at_all(test, on)) return true;
  if (test.when.count % on.every == 0 && test.when.count / on.every < on.frame_count()) return true;
  sink.report("bad-array-file", test.on_origin.range,
              {on.path, fmt::format("its {} frames, {} steps apart, do not reach exactly {} steps from the first",
                                    on.frame_count(), on.every, test.when.count)},
              fmt::format("it reaches {} steps", (on.frame_count() - 1) * on.every));
  return false;
}

const char* word_for(model::Test::Kind kind) {
  switch (kind) {
    case model::Test::Kind::number: return "test";
    case model::Test::Kind::statistic: return "statistic";
    case model::Test::Kind::spectrum: return "spectrum";
    case model::Test::Kind::correlation: return "correlation";
  }
  unreachable("kind of test");
}

/// Checks that the data have all fields of the scene that the test may read.
bool has_states(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on,
                DiagnosticSink& sink) {
  if (test.kind == model::Test::Kind::number) return true;
  const dpde_program& program = *scene.compiled->program(scene.compiled->names.tests.at(test.quantity.name));
  for (const model::State& state : scene.compiled->problem->states) {
    const bool is_read = std::ranges::any_of(std::span(program.fields, static_cast<std::size_t>(program.field_count)),
                                             [&](const char* field) { return state.name == field; });
    if (!is_read || std::ranges::find(on.states, state.name) != on.states.end()) continue;
    sink.report("bad-array-file", test.on_origin.range,
                {on.path, fmt::format("it has no {}, of which {} {} is to be compared", state.name, word_for(test.kind),
                                      test.quantity.name)},
                fmt::format("it has {}", fmt::join(on.states, ", ")));
    return false;
  }
  return true;
}

std::optional<files::Trajectories> load_test(const TrainingScene& scene, const model::Test& test,
                                             const SourceFile& source, DiagnosticSink& sink) {
  std::optional<files::Trajectories> on =
      files::load_trajectories(*scene.compiled->problem, test.on, source, test.on_origin.range, sink);
  if (!on || !fits(test, *on, sink) || !runs_are_of_this_scene(scene, *on, test.on_origin.range, sink))
    return std::nullopt;
  return on;
}

TrajectoryTest roll_out(const model::Test& test, const TrainingScene& scene, const std::string& file,
                        const files::Trajectories& on, const UnknownValues& values, const BatchOptions& options) {
  const model::Problem& problem = *scene.compiled->problem;
  TrajectoryTest result{test.quantity.name, problem.scene, file, test.kind, {}, {}, {}, !problem.networks.empty()};
  result.threshold = test.threshold;
  for (std::size_t p = 0; p < on.params.size(); ++p) {
    for (const files::Trajectories::Run& run : on.runs) result.params[on.params[p]].push_back(run.params[p]);
  }
  std::deque<SolveNote> met;
  result.runs = over_runs(
      scene, on, values, options, [&](TrajectoryEvaluator& evaluator, int run) { return evaluator.roll(test, run); },
      &met);
  result.solves = driver::solves_of(*scene.compiled, met);
  const bool has_data = test.kind == model::Test::Kind::statistic || test.kind == model::Test::Kind::spectrum;
  if (has_data)
    result.data = over_runs(scene, on, values, options,
                            [&](TrajectoryEvaluator& evaluator, int run) { return evaluator.look_at_data(test, run); });
  for (int k = 1; k <= frames_of(test, scene, on); ++k)
    result.times.push_back(time_of_look(test, scene, on, k) - on.times[0]);
  if (test.kind != model::Test::Kind::spectrum) return result;
  const Spectrum spectrum(problem.axes);
  result.last_resolved = spectrum.last_resolved();
  result.unit = spectrum.unit();
  result.noise = noise_of(problem.scheme.real);
  return result;
}

}  // namespace

std::vector<double> TrajectoryTest::errors() const {
  if (kind != model::Test::Kind::correlation) return means();
  std::vector<double> all;
  for (const std::vector<double>& run : runs) all.push_back(1 / first_below(times, run, threshold).time);
  return all;
}

bool TrajectoryTest::has_runs_of(const TrajectoryTest& other) const {
  constexpr double rounding = 1e-6;  // of numbers in files
  const auto is_alike = [](double a, double b) {
    return std::abs(a - b) <= rounding * std::max(std::abs(a), std::abs(b));
  };
  const auto are_its = [&](const auto& param) {
    const auto its = other.params.find(param.first);
    return its == other.params.end() || std::ranges::equal(param.second, its->second, is_alike);
  };
  return runs.size() == other.runs.size() && std::ranges::all_of(params, are_its);
}

std::vector<double> TrajectoryTest::means_of(const Runs& runs) {
  std::vector<double> result;
  for (const std::vector<double>& run : runs) {
    double sum = 0;
    for (const double value : run) sum += value;
    result.push_back(sum / static_cast<double>(run.size()));
  }
  return result;
}

std::vector<double> TrajectoryTest::course_of(const Runs& runs) {
  std::vector<double> result(runs.empty() ? 0 : runs[0].size());
  for (const std::vector<double>& run : runs) {
    for (std::size_t k = 0; k < run.size(); ++k) result[k] += run[k] / static_cast<double>(runs.size());
  }
  return result;
}

std::vector<double> TrajectoryTest::deviations_of(const Runs& runs) {
  std::vector<double> result;
  for (const std::vector<double>& run : runs) result.push_back(mean_and_spread(run).spread);
  return result;
}

MeanAndSpread mean_and_spread(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  MeanAndSpread result;
  for (const double value : values) result.mean += value / count;
  if (values.size() < 2 || !std::isfinite(result.mean)) return {result.mean, std::numeric_limits<double>::quiet_NaN()};
  for (const double value : values) result.spread += (value - result.mean) * (value - result.mean) / (count - 1);
  result.spread = std::sqrt(result.spread);
  return result;
}

namespace {

double interval_of(const TrainingScene& scene, const files::Trajectories& on) {
  return on.every * scene.compiled->problem->step;
}

/// Checks that a compared scene has the fields of a statistic and the same times.
bool check_beside(const model::Test& test, double interval, const model::Test::Baseline& beside,
                  const TrainingScene& scene, DiagnosticSink& sink) {
  const double own = interval_of(scene, scene.trajectories);
  if (std::abs(own - interval) <= 1e-6 * interval) return has_states(test, scene, scene.trajectories, sink);
  sink.report("bad-array-file", beside.origin.range,
              {scene.trajectories.path,
               fmt::format("its frames are {:.6g} apart, those of {}, which the task's own scene is tested on, {:.6g}",
                           own, test.on, interval)});
  return false;
}

}  // namespace

std::unique_ptr<TestScenes> TestScenes::open(const TrainingScene& own, const SourceFile& source,
                                             std::vector<model::Test> tests, std::vector<model::Test> growths,
                                             DiagnosticSink& sink) {
  std::vector<model::Test> all = tests;
  all.insert(all.end(), growths.begin(), growths.end());
  std::vector<double> intervals;
  for (const model::Test& test : all) {
    const std::optional<files::Trajectories> on = load_test(own, test, source, sink);
    if (!on || !has_states(test, own, *on, sink)) return nullptr;
    intervals.push_back(interval_of(own, *on));
  }
  std::unique_ptr<TestScenes> scenes(new TestScenes{
      own, source, std::move(tests), std::move(growths), BesideScenes::open(own, all, source, sink), {}});
  if (!scenes->beside) return nullptr;
  for (std::size_t i = 0; i < scenes->tests.size(); ++i) {
    const model::Test& test = scenes->tests[i];
    for (const model::Test::Baseline& beside : test.beside) {
      if (!check_beside(test, intervals[i], beside, scenes->beside->scene(beside), sink)) return nullptr;
    }
  }
  const auto add = [&](const std::string& scene) {
    std::unique_ptr<GrowthScene>& growth = scenes->growth_scenes[scene];
    if (!growth) growth = GrowthScene::open(*own.compiled, scene, source, sink);
    return growth != nullptr;
  };
  for (const model::Test& growth : scenes->growths) {
    if (!add(own.compiled->problem->scene)) return nullptr;
    for (const model::Test::Baseline& beside : growth.beside) {
      if (!add(beside.scene)) return nullptr;
    }
  }
  return scenes;
}

bool TestScenes::add(std::size_t test, const model::Test::Baseline& scene, DiagnosticSink& sink) {
  model::Test& to = tests[test];
  if (!beside->add(to, scene, source, sink)) return false;
  const TrainingScene& opened = beside->scene(scene);
  const double interval = interval_of(opened, opened.trajectories);
  if (!check_beside(to, interval, scene, opened, sink)) return false;
  to.beside.push_back(scene);
  return true;
}

std::vector<TrajectoryTest> tests_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, DiagnosticSink& sink) {
  std::vector<TrajectoryTest> results;
  for (const model::Test& test : scenes.tests) {
    const std::optional<files::Trajectories> on = load_test(scenes.own, test, scenes.source, sink);
    if (!on) return {};
    results.push_back(roll_out(test, scenes.own, test.on, *on, values, options));
  }
  return results;
}

std::vector<std::vector<TrajectoryTest>> tests_beside(const TestScenes& scenes, const UnknownValues& values,
                                                      const BatchOptions& options) {
  std::vector<std::vector<TrajectoryTest>> results;
  for (const model::Test& test : scenes.tests) {
    std::vector<TrajectoryTest>& all = results.emplace_back();
    for (const model::Test::Baseline& beside : test.beside)
      all.push_back(test_beside(scenes, results.size() - 1, beside, values, options));
  }
  return results;
}

TrajectoryTest test_beside(const TestScenes& scenes, std::size_t test, const model::Test::Baseline& beside,
                           const UnknownValues& values, const BatchOptions& options) {
  const TrainingScene& scene = scenes.beside->scene(beside);
  TrajectoryTest found = roll_out(scenes.tests[test], scene, beside.on, scene.trajectories, values, options);
  const model::Problem &problem = *scene.compiled->problem, &own = *scenes.own.compiled->problem;
  found.scene = title_of(beside);
  found.made_data = reads_data(own, scenes.tests[test]) && made_data_of(scene, values, options);
  found.is_named = beside.method.empty();
  const std::string model = problem.model == own.model ? "" : fmt::format(" ({})", problem.model);
  found.method_kind = chart::kind_of_method(problem) + model;
  return found;
}

std::vector<TestConditions> conditions_of_tests(const TestScenes& scenes, bool knows_training, DiagnosticSink& sink) {
  std::vector<TestConditions> all;
  std::map<std::string, TestConditions> of_files;
  for (const model::Test& test : scenes.tests) {
    auto there = of_files.find(test.on);
    if (there == of_files.end()) {
      const std::optional<files::Trajectories> on = load_test(scenes.own, test, scenes.source, sink);
      if (!on) return {};
      there = of_files.emplace(test.on, conditions_of(knows_training ? &scenes.own.trajectories : nullptr, *on)).first;
    }
    all.push_back(there->second);
    all.back().steps_of_windows = scenes.own.steps();
    all.back().steps = test.when.count;
  }
  return all;
}

double TestCost::least() const {
  double least = samples.front();
  for (const double value : samples) least = std::isnan(value) || value < least ? value : least;
  return least;
}

double TestCost::median() const {
  if (std::ranges::any_of(samples, [](double value) { return std::isnan(value); })) return std::nan("");
  std::vector<double> sorted = samples;
  std::ranges::sort(sorted);
  return sorted[sorted.size() / 2];
}

std::vector<std::vector<TestCost>> costs_of_tests(const TestScenes& scenes, const UnknownValues& values,
                                                  const BatchOptions& options, const CostTiming& timing,
                                                  DiagnosticSink& sink) {
  std::vector<std::vector<TestCost>> costs;
  for (const model::Test& test : scenes.tests) {
    std::vector<TestCost>& all = costs.emplace_back();
    if (!is_compared(test)) continue;
    const std::optional<files::Trajectories> on = load_test(scenes.own, test, scenes.source, sink);
    if (!on) return {};
    std::deque<TrajectoryEvaluator> evaluators;
    evaluators.emplace_back(scenes.own, *on, values, options);
    for (const model::Test::Baseline& beside : test.beside) {
      const TrainingScene& scene = scenes.beside->scene(beside);
      evaluators.emplace_back(scene, scene.trajectories, values, options);
    }
    all.resize(evaluators.size());
    for (int r = 0; r < timing.samples; ++r) {
      for (std::size_t s = 0; s < evaluators.size(); ++s)
        all[s].samples.push_back(evaluators[s].cost(test, timing.seconds));
    }
  }
  return costs;
}

std::vector<GrowthTest> growths_on_trajectories(const TestScenes& scenes, const UnknownValues& values,
                                                const BatchOptions& options, DiagnosticSink& sink) {
  std::vector<GrowthTest> results;
  const std::string& name = scenes.own.compiled->problem->scene;
  for (const model::Test& growth : scenes.growths) {
    const std::optional<files::Trajectories> on = load_test(scenes.own, growth, scenes.source, sink);
    if (!on) return {};
    results.push_back({growth.quantity.name, name, growth.on,
                       scenes.growth_scenes.at(name)->rates(*on, growth.when.count, values, options)});
  }
  return results;
}

std::vector<std::vector<GrowthTest>> growths_beside(const TestScenes& scenes, const UnknownValues& values,
                                                    const BatchOptions& options) {
  std::vector<std::vector<GrowthTest>> results;
  for (const model::Test& growth : scenes.growths) {
    std::vector<GrowthTest>& all = results.emplace_back();
    for (const model::Test::Baseline& beside : growth.beside) {
      const TrainingScene& scene = scenes.beside->scene(beside);
      UnknownValues learnt;  // only the networks: the scene has parameters of its own
      for (const network::Network& network : scene.compiled->problem->networks) {
        if (values.contains(network.name)) learnt[network.name] = values.at(network.name);
      }
      const auto steps =
          static_cast<int>(std::lround(growth.when.count * scene.own_step / scene.compiled->problem->step));
      all.push_back({growth.quantity.name, beside.scene, beside.on,
                     scenes.growth_scenes.at(beside.scene)->rates(scene.trajectories, steps, learnt, options)});
    }
  }
  return results;
}

}  // namespace dpde::training
