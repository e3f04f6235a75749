// SPDX-License-Identifier: Apache-2.0
#include "driver/trajectory_test.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include "driver/workspace.h"
#include "dpde/runtime/error.h"

namespace dpde::driver {

namespace {

/// One thread's simulation, and fields beside it for the quantity.
class Roller {
 public:
  Roller(const TrainingScene& scene, const Trajectories& on, const Eigen::VectorXd& x, const BatchOptions& options)
      : scene_(scene), on_(on), workspace_(*scene.compiled->problem, *scene.compiled->code, {}, 1) {
    SimulationOptions each;
    each.stop = options.stop;
    simulation_.emplace(scene.table->scene(), each, scene.table);
    scene.give(*simulation_);
    x_.assign(x.data(), x.data() + x.size());
  }

  /// Of test `number`, at the frames behind the first.
  std::vector<double> roll(const model::Test& test, int run) {
    scene_.begin(*simulation_, on_, {run, 0});
    simulation_->set_unknowns(x_);
    simulation_->reset();
    take_values(run);
    const dpde_program& program = *scene_.compiled->program(scene_.task().name + "_test_" + test.quantity.name);
    std::vector<double> values;
    for (int k = 1; k <= test.when.count / on_.every; ++k) values.push_back(go_on() ? look(program, test.quantity.name, run, k) : std::numeric_limits<double>::infinity());
    return values;
  }

 private:
  /// Parameters, and coefficients by their formulas or as they were found.
  void take_values(int run) {
    for (const std::string& name : simulation_->params()) workspace_.set_param(name, simulation_->param(name));
    for (std::size_t p = 0; p < on_.params.size(); ++p) workspace_.set_param(on_.params[p], on_.runs[static_cast<std::size_t>(run)].params[p]);
    for (const std::string& network : simulation_->networks()) {
      const auto weights = workspace_.weights().find(network);
      if (weights != workspace_.weights().end()) weights->second.values = simulation_->weights(network);
    }
    const model::Problem& problem = *scene_.compiled->problem;
    if (const dpde_program* formulas = scene_.compiled->program(problem.scene + "_coefficients")) workspace_.run(*formulas, on_.times.front());
    for (const auto& [name, values] : scene_.given_fields) workspace_.set_dense(name, values);
    for (const model::Unknown& unknown : scene_.task().unknowns) {
      if (unknown.is_field()) workspace_.set_dense(unknown.name, simulation_->value_of(unknown.name));
    }
  }

  /// To the next frame; false from where the run has blown up.
  bool go_on() {
    try {
      return simulation_->run_to(simulation_->time() + on_.every * simulation_->time_step());
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::run) throw;
      return false;
    }
  }

  double look(const dpde_program& program, const std::string& name, int run, int frame) {
    for (const std::string& state : simulation_->states()) workspace_.set_dense(state, simulation_->state(state));
    for (const model::Datum& datum : scene_.task().data) {
      if (datum.trajectories) workspace_.set_dense(datum.name, on_.frames(run, datum.variable, frame));
    }
    const std::map<std::string, double> sums = workspace_.run(program, simulation_->time());
    const auto value = sums.find(name);
    return value == sums.end() ? 0 : value->second;
  }

  const TrainingScene& scene_;
  const Trajectories& on_;
  Workspace workspace_;
  std::optional<Simulation> simulation_;
  std::vector<double> x_;
};

std::vector<std::vector<double>> roll_all(const TrainingScene& scene, const Trajectories& on, const model::Test& test, const Eigen::VectorXd& x, const BatchOptions& options) {
  const auto runs = static_cast<std::int64_t>(on.runs.size());
  std::deque<Roller> rollers;
  for (std::int64_t t = 0; t < std::clamp<std::int64_t>(options.threads, 1, runs); ++t) rollers.emplace_back(scene, on, x, options);
  std::vector<std::vector<double>> values(on.runs.size());
  std::vector<std::exception_ptr> errors(on.runs.size());
#pragma omp parallel for schedule(static, 1) num_threads(static_cast<int>(rollers.size()))
  for (std::int64_t run = 0; run < runs; ++run) {
    try {
      values[static_cast<std::size_t>(run)] = rollers[static_cast<std::size_t>(omp_get_thread_num())].roll(test, static_cast<int>(run));
    } catch (...) {
      errors[static_cast<std::size_t>(run)] = std::current_exception();
    }
  }
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
  return values;
}

bool fits(const model::Test& test, const Trajectories& on, DiagnosticSink& sink) {
  if (test.when.count % on.every == 0 && test.when.count / on.every < on.frame_count()) return true;
  sink.report("bad-array-file", test.on_origin.range,
              {on.path, fmt::format("its {} frames, {} steps apart, do not reach exactly {} steps from the first", on.frame_count(), on.every, test.when.count)},
              fmt::format("it reaches {} steps", (on.frame_count() - 1) * on.every));
  return false;
}

}  // namespace

std::vector<double> TrajectoryTest::means() const {
  std::vector<double> result;
  for (const std::vector<double>& run : runs) {
    double sum = 0;
    for (const double value : run) sum += value;
    result.push_back(sum / static_cast<double>(run.size()));
  }
  return result;
}

std::vector<double> TrajectoryTest::course() const {
  std::vector<double> result(times.size());
  for (const std::vector<double>& run : runs) {
    for (std::size_t k = 0; k < run.size(); ++k) result[k] += run[k] / static_cast<double>(runs.size());
  }
  return result;
}

MeanAndSpread mean_and_spread(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  MeanAndSpread result;
  for (const double value : values) result.mean += value / count;
  if (values.size() < 2) return result;
  for (const double value : values) result.spread += (value - result.mean) * (value - result.mean) / (count - 1);
  result.spread = std::sqrt(result.spread);
  return result;
}

namespace {

std::optional<Trajectories> load_test(const TrainingScene& scene, const model::Test& test, const SourceFile& source, DiagnosticSink& sink) {
  std::optional<Trajectories> on = load_trajectories(*scene.compiled->problem, test.on, source, test.on_origin.range, sink);
  if (!on || !fits(test, *on, sink) || !runs_are_of_this_scene(scene, *on, test.on_origin.range, sink)) return std::nullopt;
  return on;
}

}  // namespace

bool check_tests(const TrainingScene& scene, const SourceFile& source, DiagnosticSink& sink) {
  return std::ranges::all_of(scene.task().tests, [&](const model::Test& test) { return test.on.empty() || load_test(scene, test, source, sink).has_value(); });
}

std::vector<TrajectoryTest> tests_on_trajectories(const TrainingScene& scene, const Eigen::VectorXd& x, const SourceFile& source, const BatchOptions& options, DiagnosticSink& sink) {
  std::vector<TrajectoryTest> results;
  for (const model::Test& test : scene.task().tests) {
    if (test.on.empty()) continue;
    const std::optional<Trajectories> on = load_test(scene, test, source, sink);
    if (!on) continue;
    TrajectoryTest& result = results.emplace_back(TrajectoryTest{test.quantity.name, test.on, {}, {}});
    for (int k = 1; k <= test.when.count / on->every; ++k) result.times.push_back(on->times[static_cast<std::size_t>(k)] - on->times[0]);
    result.runs = roll_all(scene, *on, test, x, options);
  }
  return results;
}

}  // namespace dpde::driver
