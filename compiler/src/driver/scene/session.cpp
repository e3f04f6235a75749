// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "driver/compile/declared.h"
#include "driver/memory/cost.h"
#include "driver/memory/memory_plan.h"
#include "driver/memory/tuning.h"
#include "driver/scene/data.h"
#include "driver/scene/wall_values.h"
#include "driver/scene/window_start.h"
#include "files/array_file.h"
#include "model/analyse/placement.h"
#include "model/boundary/metric.h"

namespace dpde::driver {

namespace {

constexpr const char* not_finite_hint =
    "a formula is not finite where it divides by 0, or takes a root or log of a number that has none";

bool is_field(const dpde_program& program, const std::string& field) {
  for (int f = 0; f < program.field_count; ++f) {
    if (program.fields[f] == field) return true;
  }
  return false;
}

std::int64_t coordinate(const Cell& cell, std::size_t axis) { return axis == 0 ? cell.x : axis == 1 ? cell.y : cell.z; }

}  // namespace

std::unique_ptr<Session> Session::open(const SourceFile& source, std::shared_ptr<const Compiled> compiled,
                                       const SessionOptions& options, DiagnosticSink& sink) {
  std::unique_ptr<Session> session(new Session);
  session->compiled_ = std::move(compiled);
  session->options_ = options;
  session->steps_ = options.steps.value_or(session->problem().steps);
  if (options.window != nullptr)
    session->options_.steps = session->steps_ = options.window->whole_frames(session->steps_);
  session->axes_ = session->problem().axes;
  for (std::size_t a = 0; a < std::min(options.cells.size(), session->axes_.size()); ++a)
    session->axes_[a].cells = options.cells[a];
  try {
    if (options.cells.empty() && !run_fits(*session->compiled_, source, sink)) return nullptr;
    session->options_.checkpoint_bytes =
        budget_of_states({options.threads, options.checkpoint_bytes, options.checkpoint_folder});
    if (!session->load(source, sink)) return nullptr;
  } catch (const std::exception& error) {
    report_error(error, sink, place_of(source, session->problem().scene));
    return nullptr;
  }
  return session;
}

EngineOptions Session::engine_options() {
  EngineOptions result;
  result.cells = {options_.cells.begin(), options_.cells.end()};
  result.threads = options_.threads;
  result.checkpoint_bytes = options_.checkpoint_bytes;
  result.slots = options_.slots;
  result.checkpoint_folder = options_.checkpoint_folder;
  result.stop = options_.stop;
  result.trusts_signs = options_.trusts_signs || options_.made_up;
  result.find_tuning = [this](const RolloutSetup& setup) { return tuning_ = find_tuning(*compiled_, setup); };
  for (const std::string& name : compiled_->code->names()) {
    const dpde_program& program = *compiled_->code->find(name);
    for (std::size_t a = 0; a < 3; ++a) result.halo[a] = std::max(result.halo[a], program.halo[a]);
  }
  return result;
}

bool Session::load(const SourceFile& source, DiagnosticSink& sink) {
  table_ = SceneTable::make(
      compiled_, source,
      {true, options_.steps, options_.made_up, options_.window == nullptr ? 0 : options_.window->every}, sink);
  if (!table_) return false;
  engine_ = std::make_unique<Engine>(table_->scene(), engine_options(), table_);
  for (const std::string& name : compiled_->code->names()) {  // programs other than the scene's
    const dpde_program& program = *compiled_->code->find(name);
    for (int n = 0; n < program.network_count; ++n) workspace().add_weights(*program.networks[n], nullptr);
  }
  if (options_.window != nullptr) load_window();
  const bool is_ready = load_coefficients(source, sink) && load_data(source, sink) && has_data_for_losses(sink) &&
                        load_states(source, sink) && coefficients_finite(sink) && starts_finite(sink);
  if (is_ready && !options_.made_up && options_.cells.empty()) warn_of_wall_values(*this, sink);
  return is_ready;
}

bool Session::load_coefficients(const SourceFile& source, DiagnosticSink& sink) {
  for (const model::Coefficient& coefficient : problem().coefficients) {
    if (coefficient.value.formula) continue;
    const std::optional<std::vector<double>> values =
        load_coefficient(*this, coefficient, coefficient.value, source, sink);
    if (!values) return false;
    engine_->set_field(coefficient.name, *values);
  }
  return true;
}

bool Session::load_data(const SourceFile& source, DiagnosticSink& sink) {
  if (!problem().task) return true;
  for (const model::Datum& datum : problem().task->data) {
    std::optional<DataStates> states = load_datum(*this, datum, source, sink);
    if (!states) return false;
    std::vector<int> at;
    for (const double t : states->times)
      at.push_back(static_cast<int>(std::lround((t - problem().t_begin) / problem().step)));
    engine_->take_datum(datum.name, std::move(at));
    data_.push_back(std::move(*states));
  }
  return true;
}

/// Values resampled to the session's grid.
std::vector<double> Session::on_grid(const std::vector<double>& values) const {
  return options_.cells.empty() ? values : resample(values, problem().axes, axes_);
}

void Session::load_window() {
  engine_->begin_at(options_.window->t);
  for (const auto& [name, value] : options_.window->params) engine_->set_param(name, value);
}

/// A training sample comes with the data of its losses.
bool Session::has_data_for_losses(DiagnosticSink& sink) {
  if (options_.window != nullptr) return true;
  for (std::size_t i = 0; problem().task && i < problem().task->losses.size(); ++i) {
    const model::Loss& loss = problem().task->losses[i];
    const dpde_program& program = *compiled_->program(compiled_->names.losses[i]);
    for (const DataStates& datum : data_) {
      for (const int step : is_field(program, datum.name) ? steps_of(loss.when) : std::vector<int>{}) {
        if (datum_at(datum, time_of(step)) != nullptr) continue;
        sink.report("data-without-time", loss.origin.range, {datum.name, fmt::format("{}", time_of(step))});
        return false;
      }
    }
  }
  return true;
}

bool Session::load_states(const SourceFile& source, DiagnosticSink& sink) {
  for (const model::State& state : problem().states) {
    const int index = engine_->state_index(state.name);
    if (index < 0) continue;
    if (options_.window != nullptr && options_.window->states.contains(state.name)) {
      engine_->set_initial(static_cast<std::size_t>(index), on_grid(options_.window->states.at(state.name)));
      continue;
    }
    if (state.initial.file.empty()) continue;
    std::optional<std::vector<double>> values = made_up_values(workspace().cell_count());
    if (!options_.made_up) {
      const std::vector<model::Axis> axes = model::axes_at(problem().axes, state.placement);
      values =
          files::load_array(state.initial, problem().unit_of(state.name), source, axes, problem().scheme.real, sink);
      if (!values) return false;
      values = on_grid(*values);
    }
    engine_->set_initial(static_cast<std::size_t>(index), *values);
  }
  engine_->update_formulas();
  return true;
}

/// Checks all intervals of a control field.
bool Session::coefficients_finite(DiagnosticSink& sink) {
  for (const model::Coefficient& coefficient : problem().coefficients) {
    const ControlField* control = workspace().find_control_field(coefficient.name);
    for (std::size_t i = 0; i < (control == nullptr ? 1 : control->at.size()); ++i) {
      const Field& values = workspace().field(coefficient.name, i);
      const std::optional<Cell> bad = find_not_finite(values.layout(), values.base());
      if (!bad) continue;
      sink.report("coefficient-not-finite", coefficient.value.origin.range,
                  {coefficient.name, cell_text(*bad), place_text(*bad)}, not_finite_hint);
      return false;
    }
  }
  return true;
}

bool Session::starts_finite(DiagnosticSink& sink) {
  for (int s = 0; s < rollout().state_count(); ++s) {
    const Field& start = rollout().initial(s);
    const std::optional<Cell> bad = find_not_finite(start.layout(), start.base());
    if (!bad) continue;
    const model::State* state = problem().find_state(rollout().state_name(s));
    const SourceRange where = state == nullptr ? SourceRange{} : state->initial.origin.range;
    sink.report("start-not-finite", where, {rollout().state_name(s), cell_text(*bad), place_text(*bad)},
                not_finite_hint);
    return false;
  }
  return true;
}

/// Stores the rollout's tuning for the next session.
Session::~Session() {
  if (engine_ == nullptr || !engine_->is_open()) return;
  try {
    const std::string found = rollout().tuning();
    if (found != tuning_) keep_tuning(*compiled_, engine_->setup(), found);
  } catch (const std::exception&) {  // failure is harmless: tuning is optional, and the run is over
  }
}

std::string Session::cell_text(const Cell& cell) const {
  std::vector<std::int64_t> numbers;
  for (std::size_t a = 0; a < axes_.size(); ++a) numbers.push_back(coordinate(cell, a));
  return fmt::format("{}", fmt::join(numbers, ", "));
}

std::string Session::place_text(const Cell& cell) const {
  std::vector<std::string> parts;
  for (std::size_t a = 0; a < axes_.size(); ++a)
    parts.push_back(
        fmt::format("{} = {:.6g}", model::name_of_axis(problem(), a), axes_[a].centre(coordinate(cell, a))));
  return fmt::format("{}", fmt::join(parts, ", "));
}

void* Session::datum_at(const DataStates& datum, double t) {
  if (datum.times.empty()) return workspace().field(datum.fields[0]).base();
  for (std::size_t k = 0; k < datum.times.size(); ++k) {
    if (std::abs(datum.times[k] - t) < 1e-6 * problem().step) return workspace().field(datum.fields[k]).base();
  }
  return nullptr;
}

std::vector<double> Session::initial(int state) {
  std::vector<double> values(workspace().cell_count());
  rollout().initial(state).copy_out(values);
  return values;
}

std::vector<double> Session::final_state(int state) {
  std::vector<double> values(workspace().cell_count());
  copy_out(workspace().layout(), rollout().final_states()[static_cast<std::size_t>(state)], values);
  return values;
}

Workspace::Bound Session::bind_states(const std::vector<void*>& states) {
  Workspace::Bound bound;
  for (std::size_t s = 0; s < states.size(); ++s) bound[engine_->states()[s].name] = states[s];
  return bound;
}

double Session::evaluate(const dpde_program& program, const std::string& sum, double t,
                         const std::vector<void*>& states) {
  Workspace::Bound bound = bind_states(states);
  for (const DataStates& datum : data_) {
    if (!is_field(program, datum.name)) continue;
    void* const base = datum_at(datum, t);
    if (base == nullptr) return NAN;
    bound[datum.name] = base;
  }
  const std::map<std::string, double> sums = workspace().run(program, t, bound);
  const auto value = sums.find(sum);
  return value == sums.end() ? 0 : value->second;
}

std::vector<std::pair<std::string, double>> Session::observe(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.observe);
  std::vector<std::pair<std::string, double>> values;
  if (program == nullptr) return values;
  const std::map<std::string, double> sums = workspace().run(*program, t, bind_states(states));
  for (const model::Quantity& quantity : problem().observables) {
    const auto sum = sums.find(quantity.name);
    values.emplace_back(quantity.name, sum == sums.end() ? 0 : sum->second);
  }
  return values;
}

std::map<std::string, std::vector<double>> Session::shown(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.shown);
  std::map<std::string, std::vector<double>> values;
  if (program == nullptr) return values;
  workspace().run(*program, t, bind_states(states));
  // The program stores one field for each, in order.
  auto kept = compiled_->stencil.find_program(compiled_->names.shown)->keeps.begin();
  for (const model::OutputField& shown : problem().shown) values.emplace(shown.name, workspace().dense(*kept++));
  workspace().release(*program);
  return values;
}

std::vector<Session::Miss> Session::misses(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.constraints);
  std::vector<Miss> result;
  if (program == nullptr) return result;
  const std::map<std::string, double> sums = workspace().run(*program, t, bind_states(states));
  const auto sum_of = [&](const std::string& name) { return sums.contains(name) ? sums.at(name) : 0; };
  for (const model::Projection& projection : problem().projections) {
    if (!projection.potential) continue;
    const auto& [miss, terms] = compiled_->names.misses[result.size()];
    result.push_back({projection.multiplier, sum_of(miss), sum_of(terms), projection.origin});
  }
  return result;
}

namespace {

/// Scaled by the largest value, since squares above 1e154 overflow. `weights` have mean 1.
double root_mean_square(const std::vector<double>& values, const std::vector<double>& weights) {
  double largest = 0, sum = 0;
  for (const double v : values) largest = std::max(largest, std::abs(v));
  const double unit = largest > 1e150 || (largest > 0 && largest < 1e-150) ? largest : 1;
  for (std::size_t i = 0; i < values.size(); ++i) sum += weights[i] * (values[i] / unit) * (values[i] / unit);
  return unit * std::sqrt(sum / static_cast<double>(values.size()));
}

constexpr double size_on_pole = 1e-12;  // relative to the mean: faces on a pole, whose values the boundary sets

/// 1 for each cell; with curvilinear coordinates its volume relative to the mean, 0 on poles.
std::vector<double> weights_of_errors(const Session& session, const model::State& state) {
  const std::size_t cells = session.workspace().cell_count();
  if (!session.problem().metric) return std::vector<double>(cells, 1.0);
  std::vector<double> weights = model::cell_volumes(session.axes(), session.problem().metric, state.placement);
  double sum = 0;
  for (const double weight : weights) sum += weight;
  for (double& weight : weights) {
    weight *= static_cast<double>(cells) / sum;
    if (weight < size_on_pole) weight = 0;
  }
  return weights;
}

}  // namespace

std::vector<ErrorNorms> Session::errors(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.exact);
  std::vector<ErrorNorms> norms;
  if (program == nullptr) return norms;
  workspace().run(*program, t);
  std::vector<double> computed(workspace().cell_count());
  // The program stores one field for each state with an exact solution, in the order of the states.
  auto kept = compiled_->stencil.find_program(compiled_->names.exact)->keeps.begin();
  for (const model::State& state : problem().states) {
    const int index = rollout().state_index(state.name);
    if (!state.exact) continue;
    const std::vector<double> exact = workspace().dense(*kept++);
    if (index < 0) continue;
    copy_out(workspace().layout(), states[static_cast<std::size_t>(index)], computed);
    ErrorNorms norm{state.name};
    const std::vector<double> weights = weights_of_errors(*this, state);
    norm.scale = root_mean_square(exact, weights);
    for (std::size_t i = 0; i < computed.size(); ++i) {
      computed[i] = std::abs(computed[i] - exact[i]);
      norm.l1 += weights[i] * computed[i] / static_cast<double>(computed.size());
      const bool is_larger = computed[i] > norm.linf || std::isnan(computed[i]);
      if (is_larger && weights[i] > 0) norm.linf = computed[i];
    }
    norm.l2 = root_mean_square(computed, weights);
    norms.push_back(norm);
  }
  workspace().release(*program);
  return norms;
}

namespace {

void report_unsolved(const Unsolved& error, DiagnosticSink& sink, SourceRange range) {
  const std::string what = error.what(), hint = error.hint();
  switch (error.facts().what) {
    case UnsolvedFacts::What::solve: sink.report("solve-failed", range, {what}, hint); break;
    case UnsolvedFacts::What::newton: sink.report("newton-failed", range, {what}, hint); break;
    case UnsolvedFacts::What::substeps: sink.report("substeps-failed", range, {what}, hint); break;
    case UnsolvedFacts::What::steady: sink.report("run-failed", range, {what}, hint); break;
    case UnsolvedFacts::What::jump: sink.report("branches-do-not-meet", range, {what}, hint); break;
  }
}

}  // namespace

void report_error(const std::exception& error, DiagnosticSink& sink, SourceRange range) {
  if (const auto* unsolved = dynamic_cast<const Unsolved*>(&error)) {
    report_unsolved(*unsolved, sink, range);
    return;
  }
  if (const Error* known = dynamic_cast<const Error*>(&error)) {
    switch (known->kind()) {
      case ErrorKind::input: sink.report("bad-option", range, {known->what()}); return;
      case ErrorKind::run: sink.report("run-failed", range, {known->what()}); return;
      case ErrorKind::machine: sink.report("machine-failed", range, {known->what()}); return;
    }
  }
  const auto* of_system = dynamic_cast<const std::system_error*>(&error);
  if (of_system != nullptr && of_system->code() == std::errc::resource_unavailable_try_again) {
    sink.report("machine-failed", range, {"the system lets this user make no further thread"},
                "ulimit -u, or what a container allows, is the limit; --threads 1 needs fewer");
    return;
  }
  const bool lacks_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
                            dynamic_cast<const std::length_error*>(&error) != nullptr;
  const bool fails_as_it_runs = dynamic_cast<const std::runtime_error*>(&error) != nullptr;
  if (!lacks_memory && !fails_as_it_runs) {
    // E.g. a key that is missing in a map: a fault of dpde, not of the user or the machine.
    sink.report("broken-invariant", range, {"run", error.what()},
                "please report it, with the text that brings it about");
    return;
  }
  sink.report("machine-failed", range, {lacks_memory ? std::string("not enough memory") : std::string(error.what())});
}

}  // namespace dpde::driver
