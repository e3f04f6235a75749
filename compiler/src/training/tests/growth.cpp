// SPDX-License-Identifier: Apache-2.0
#include "training/tests/growth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/random.h"
#include "dpde/runtime/team.h"
#include "driver/scene/session.h"
#include "training/tests/beside.h"

namespace dpde::training {

namespace {

constexpr std::uint64_t seed = 1, stream = 0x67726f777468;  // differs by run: the spread shows convergence

/// States and their tangent in one thread.
class Tangent {
 public:
  Tangent(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled, const files::Trajectories& on,
          int steps, const UnknownValues& values, const BatchOptions& options)
      : on_(on), steps_(steps), values_(values) {
    driver::SessionOptions alone;
    alone.stop = options.stop;
    DiagnosticSink sink;
    session_ = driver::Session::open(source, std::move(compiled), alone, sink);
    if (!session_) throw Error(ErrorKind::run, sink.all().front().message);
    const adjoint::Derivative& tangent = *session_->compiled().derived.at(session_->compiled().step_name()).tangent;
    session_->engine().begin_at(on.times.front());
    RolloutSetup setup = session_->setup();
    setup.step = session_->compiled().program(tangent.program);
    setup.steps = steps;
    rollout_ = std::make_unique<Rollout>(std::move(setup));
    for (int s = 0; s < rollout_->state_count(); ++s) {
      for (const model::State& state : session_->problem().states) {
        if (rollout_->state_name(s) == state.name) states_.emplace_back(s, state.name);
        const std::string* const rate = tangent.field(state.name);
        if (rate != nullptr && rollout_->state_name(s) == *rate) rates_.push_back(s);
      }
    }
    cells_.resize(session_->workspace().cell_count());
  }

  double rate(int run) {
    begin(run);
    rollout_->restart();
    scale_back();
    double sum = 0;
    const int first = steps_ / 2;
    for (int k = 0; k < steps_; ++k) {
      if (rollout_->advance(1).stopped) return std::nan("");
      const double norm = scale_back();
      if (norm == 0) return -std::numeric_limits<double>::infinity();
      if (!std::isfinite(norm)) return std::numeric_limits<double>::infinity();
      if (k >= first) sum += std::log(norm);
    }
    return sum / ((steps_ - first) * session_->problem().step);
  }

 private:
  void begin(int run) {
    Engine& engine = session_->engine();
    for (const model::Parameter& param : session_->problem().params) {
      const auto value = values_.find(param.name);
      if (value != values_.end() && value->second.size() == 1) engine.set_param(param.name, value->second[0]);
    }
    for (std::size_t p = 0; p < on_.params.size(); ++p)
      engine.set_param(on_.params[p], on_.runs[static_cast<std::size_t>(run)].params[p]);
    for (const auto& [network, weights] : engine.workspace().weights()) {
      const auto value = values_.find(network);
      if (value != values_.end()) engine.set_weights(network, value->second);
    }
    for (const model::Coefficient& coefficient : session_->problem().coefficients) {
      const auto value = values_.find(coefficient.name);
      if (value != values_.end()) engine.set_field(coefficient.name, value->second);
    }
    engine.begin_other(*rollout_);
    for (const auto& [s, name] : states_) {
      const bool is_there = std::ranges::find(on_.states, name) != on_.states.end();
      if (is_there) rollout_->initial(s).copy_in(on_.frames(run, name, 0));
    }
    for (const int s : rates_) {
      for (std::size_t i = 0; i < cells_.size(); ++i)
        cells_[i] =
            normal(seed + static_cast<std::uint64_t>(run), i * rates_.size() + static_cast<std::size_t>(s), stream);
      rollout_->initial(s).copy_in(cells_);
    }
  }

  /// Scales the tangent to RMS 1; returns the RMS before.
  double scale_back() {
    double squares = 0;
    for (const int s : rates_) {
      copy_out(session_->workspace().layout(), rollout_->present()[static_cast<std::size_t>(s)], cells_);
      for (const double value : cells_) squares += value * value;
    }
    const double norm =
        std::sqrt(squares / static_cast<double>(cells_.size() * std::max<std::size_t>(rates_.size(), 1)));
    if (norm == 0 || !std::isfinite(norm)) return norm;
    for (const int s : rates_) {
      void* base = rollout_->present()[static_cast<std::size_t>(s)];
      copy_out(session_->workspace().layout(), base, cells_);
      for (double& value : cells_) value /= norm;
      copy_in(session_->workspace().layout(), base, cells_);
    }
    return norm;
  }

  const files::Trajectories& on_;
  int steps_;
  const UnknownValues& values_;
  std::unique_ptr<driver::Session> session_;
  std::unique_ptr<Rollout> rollout_;
  std::vector<std::pair<int, std::string>> states_;
  std::vector<int> rates_;
  std::vector<double> cells_;
};

}  // namespace

std::unique_ptr<GrowthScene> GrowthScene::open(const driver::Compiled& own, const std::string& scene,
                                               const SourceFile& source, DiagnosticSink& sink) {
  driver::CompileOptions options = scene == own.problem->scene ? own.options : options_beside(own, scene);
  options.without_task = true;
  options.adjoint = options.second = false;
  options.tangent = true;
  options.runs = driver::any_number_of_runs;
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  if (!compiled) return nullptr;
  std::unique_ptr<GrowthScene> result(new GrowthScene(source));
  result->compiled_ = std::make_shared<const driver::Compiled>(std::move(*compiled));
  return result;
}

std::vector<double> GrowthScene::rates(const files::Trajectories& on, int steps, const UnknownValues& values,
                                       const BatchOptions& options) const {
  const auto runs = static_cast<std::int64_t>(on.runs.size());
  std::vector<double> rates(on.runs.size(), std::nan(""));
  if (compiled_->problem->substeps.control) return rates;  // steps with substeps: a tangent alone cannot choose them
  std::deque<Tangent> tangents;
  for (std::int64_t t = 0; t < std::clamp<std::int64_t>(options.threads, 1, runs); ++t)
    tangents.emplace_back(source_, compiled_, on, steps, values, options);
  Team(static_cast<int>(tangents.size())).run(runs, [&](std::int64_t run, int thread) {
    rates[static_cast<std::size_t>(run)] = tangents[static_cast<std::size_t>(thread)].rate(static_cast<int>(run));
  });
  return rates;
}

}  // namespace dpde::training
