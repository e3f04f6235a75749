// SPDX-License-Identifier: Apache-2.0
#include "training/tests/trajectory_evaluator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "driver/memory/cpu_time.h"

namespace dpde::training {

UnknownValues values_of(const std::vector<UnknownPart>& parts, const Eigen::VectorXd& x) {
  UnknownValues values;
  for (const UnknownPart& part : parts)
    values[part.name].assign(x.data() + part.offset, x.data() + part.offset + part.size);
  return values;
}

TrajectoryEvaluator::TrajectoryEvaluator(const TrainingScene& scene, const files::Trajectories& on,
                                         const UnknownValues& values, const BatchOptions& options)
    : scene_(scene),
      on_(on),
      workspace_(driver::make_workspace(*scene.compiled->problem, *scene.compiled->code, {})),
      values_(values),
      spectrum_(scene.compiled->problem->axes) {
  SimulationOptions each;
  each.stop = options.stop;
  simulation_.emplace(scene.table->scene(), each, scene.table);
  scene.give(*simulation_);
}

int frames_of(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on) {
  return static_cast<int>(
      std::lround(test.when.count * scene.own_step / (looks_of(test, on) * scene.compiled->problem->step)));
}

bool looks_at_all(const model::Test& test, const files::Trajectories& on) {
  return test.kind == model::Test::Kind::number && test.beside.empty() && !on.has_frames_of_data;
}

int looks_of(const model::Test& test, const files::Trajectories& on) { return looks_at_all(test, on) ? 1 : on.every; }

double time_of_look(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on, int k) {
  if (!looks_at_all(test, on)) return on.times[static_cast<std::size_t>(k)];
  return on.times[0] + k * scene.compiled->problem->step;
}

void TrajectoryEvaluator::begin(int run) {
  scene_.begin(*simulation_, on_, {run, 0});
  if (!scene_.task().unknowns.empty()) {
    std::vector<double> all;
    for (const std::string& name : simulation_->unknowns())
      all.insert(all.end(), values_.at(name).begin(), values_.at(name).end());
    simulation_->set_unknowns(all);
  } else {
    for (const std::string& network : simulation_->networks()) {
      if (values_.contains(network)) simulation_->set_weights(network, values_.at(network));
    }
  }
  simulation_->reset();
}

namespace {

/// Buffer for results: energies are summed, other values appended.
std::vector<double> room_for(const model::Test& test, const Spectrum& spectrum) {
  return std::vector<double>(test.kind == model::Test::Kind::spectrum ? spectrum.shell_count() : 0);
}

void look_at_nothing(const model::Test& test, std::vector<double>& values) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (test.kind == model::Test::Kind::spectrum) {
    std::ranges::fill(values, infinite);
  } else {
    values.push_back(test.kind == model::Test::Kind::correlation ? 0 : infinite);
  }
}

std::vector<double> over_frames(const model::Test& test, std::vector<double> values, int frames) {
  if (test.kind != model::Test::Kind::spectrum) return values;
  for (double& energy : values) energy /= frames;
  return values;
}

}  // namespace

std::vector<double> TrajectoryEvaluator::roll(const model::Test& test, int run) {
  begin(run);
  take_values(run);
  std::vector<double> values = room_for(test, spectrum_);
  for (int k = 1; k <= frames_of(test); ++k) {
    if (!go_on(looks_of(test, on_))) {
      look_at_nothing(test, values);
      continue;
    }
    for (const std::string& state : simulation_->states()) workspace_.set_dense(state, simulation_->state(state));
    look(test, run, k, values);
  }
  return over_frames(test, std::move(values), frames_of(test));
}

std::vector<double> TrajectoryEvaluator::look_at_data(const model::Test& test, int run) {
  begin(run);
  take_values(run);
  std::vector<double> values = room_for(test, spectrum_);
  for (int k = 1; k <= frames_of(test); ++k) {
    take_data(run, k);
    look(test, run, k, values);
  }
  return over_frames(test, std::move(values), frames_of(test));
}

bool TrajectoryEvaluator::makes_data(int run) {
  const double rounding = scene_.compiled->real() == Precision::f32 ? 1e-5 : 1e-13;  // relative rounding of a few steps
  begin(run);
  return go_on(on_.every) && std::ranges::all_of(on_.states, [&](const std::string& state) {
           const std::vector<double> found = simulation_->state(state);
           const std::span<const double> data = on_.frames(run, state, 1);
           double difference = 0, size = 0;
           for (std::size_t i = 0; i < data.size(); ++i) {
             difference = std::max(difference, std::abs(found[i] - data[i]));
             size = std::max(size, std::abs(data[i]));
           }
           return difference <= rounding * size;
         });
}

double TrajectoryEvaluator::cost(const model::Test& test, double at_least) {
  const int steps = frames_of(test) * looks_of(test, on_);
  double seconds = 0, time = 0;
  begin(0);
  if (!go_on(std::min(steps, 4))) return std::nan("");  // warm-up of memory and caches
  do {
    begin(0);
    const double from = simulation_->time();
    const double start = driver::thread_cpu_seconds();
    if (!go_on(steps)) return std::nan("");
    seconds += driver::thread_cpu_seconds() - start;
    time += simulation_->time() - from;
  } while (seconds < at_least);
  return seconds / time;
}

/// Sets parameters, weights, and coefficients (by formulas or learnt values).
void TrajectoryEvaluator::take_values(int run) {
  for (const std::string& name : simulation_->params()) workspace_.set_param(name, simulation_->param(name));
  for (std::size_t p = 0; p < on_.params.size(); ++p)
    workspace_.set_param(on_.params[p], on_.runs[static_cast<std::size_t>(run)].params[p]);
  for (const std::string& network : simulation_->networks()) {
    const auto weights = workspace_.weights().find(network);
    if (weights != workspace_.weights().end()) weights->second.values = simulation_->weights(network);
  }
  if (const dpde_program* formulas = scene_.compiled->program(scene_.compiled->names.coefficients))
    workspace_.run(*formulas, on_.times.front());
  for (const auto& [name, values] : scene_.given_fields) workspace_.set_dense(name, values);
  for (const model::Unknown& unknown : scene_.task().unknowns) {
    if (unknown.is_field()) workspace_.set_dense(unknown.name, simulation_->value_of(unknown.name));
  }
}

/// Returns false once the run has blown up.
bool TrajectoryEvaluator::go_on(int steps) {
  try {
    return simulation_->run_to(simulation_->time() + steps * simulation_->time_step());
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::run) throw;
    return false;
  }
}

void TrajectoryEvaluator::take_data(int run, int frame) {
  for (const std::string& state : on_.states) workspace_.set_dense(state, on_.frames(run, state, frame));
}

/// Evaluates the test at the present states.
void TrajectoryEvaluator::look(const model::Test& test, int run, int frame, std::vector<double>& values) {
  for (const model::Datum& datum : scene_.task().data) {
    if (datum.trajectories && !datum.begins_windows())
      workspace_.set_dense(datum.name, on_.frames(run, on_.name_of(datum), frame));
  }
  if (!test.has_fields()) return values.push_back(number(test, frame));
  const Components own = fields(test, frame);
  if (test.kind == model::Test::Kind::spectrum) {
    for (const std::vector<double>& component : own) spectrum_.add(component, values);
  } else {
    take_data(run, frame);
    values.push_back(correlation(own, fields(test, frame)));
  }
}

double TrajectoryEvaluator::number(const model::Test& test, int frame) {
  const std::map<std::string, double> sums =
      workspace_.run(*scene_.compiled->program(name_of(test)), time_of_look(test, scene_, on_, frame));
  const auto value = sums.find(test.quantity.name);
  return value == sums.end() ? 0 : value->second;
}

Components TrajectoryEvaluator::fields(const model::Test& test, int frame) {
  workspace_.run(*scene_.compiled->program(name_of(test)), time_of_look(test, scene_, on_, frame));
  Components all;
  for (const std::string& field : scene_.compiled->stencil.find_program(name_of(test))->keeps)
    all.push_back(workspace_.dense(field));
  return all;
}

}  // namespace dpde::training
