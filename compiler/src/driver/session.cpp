// SPDX-License-Identifier: Apache-2.0
#include "driver/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "dpde/runtime/error.h"
#include "driver/array_file.h"
#include "driver/cost.h"
#include "driver/data.h"
#include "driver/links.h"
#include "driver/tuning.h"
#include "driver/weights.h"
#include "model/build.h"
#include "model/placement.h"
#include "support/evaluate.h"

namespace dpde::driver {

namespace {

bool is_field(const dpde_program& program, const std::string& field) {
  for (int f = 0; f < program.field_count; ++f) {
    if (program.fields[f] == field) return true;
  }
  return false;
}

std::string gibibytes(double bytes) { return fmt::format("{:.3g} GiB", bytes / (1 << 30)); }

/// Asking for more than there is would end the process without a word.
bool fits_in_memory(const Compiled& compiled, DiagnosticSink& sink) {
  const double needed = memory_of(compiled).run, there = static_cast<double>(available_memory());
  if (needed <= there) return true;
  sink.report("machine-failed", {},
              {fmt::format("scene {} needs {} of memory, {} are available", compiled.problem->scene, gibibytes(needed),
                           gibibytes(there))});
  return false;
}

}  // namespace

std::unique_ptr<Session> Session::open(const SourceFile& source, std::shared_ptr<const Compiled> compiled,
                                       const SessionOptions& options, DiagnosticSink& sink) {
  std::unique_ptr<Session> session(new Session);
  session->compiled_ = std::move(compiled);
  session->options_ = options;
  session->steps_ = options.steps.value_or(session->problem().steps);
  try {
    if (options.cells.empty() && !fits_in_memory(*session->compiled_, sink)) return nullptr;
    session->options_.checkpoint_bytes =
        budget_of_states({options.threads, options.checkpoint_bytes, options.checkpoint_folder});
    session->workspace_ =
        std::make_unique<Workspace>(session->problem(), *session->compiled_->code, options.cells, options.threads);
    if (!session->load(source, sink)) return nullptr;
  } catch (const std::exception& error) {
    report_error(error, sink);
    return nullptr;
  }
  return session;
}

bool Session::load(const SourceFile& source, DiagnosticSink& sink) {
  if (!load_coefficients(source, sink) || !load_states(source, sink)) return false;
  if (problem().task) {
    for (const model::Datum& datum : problem().task->data) {
      std::optional<DataStates> states = load_datum(*this, datum, source, sink);
      if (!states) return false;
      data_.push_back(std::move(*states));
    }
  }
  if (!make_rollout(sink)) return false;
  reset_initial();
  for (int s = 0; s < rollout_->state_count(); ++s) {
    const Field& start = rollout_->initial(s);
    const std::optional<Cell> bad = find_not_finite(start.layout(), start.base());
    if (!bad) continue;
    const model::State* state = problem().find_state(rollout_->state_name(s));
    const SourceRange where = state == nullptr ? SourceRange{} : state->initial.origin.range;
    sink.report("start-not-finite", where,
                {rollout_->state_name(s), workspace_->cell_text(*bad), workspace_->place_text(*bad)});
    return false;
  }
  return true;
}

bool Session::load_coefficients(const SourceFile& source, DiagnosticSink& sink) {
  const std::optional<NetworkWeights> weights =
      options_.made_up ? NetworkWeights{} : load_weights(problem(), source, sink);
  if (!weights) return false;
  for (const auto& [name, values] : *weights) {
    const auto place = workspace_->weights().find(name);
    if (place != workspace_->weights().end()) place->second.values = values;
  }
  for (const model::Coefficient& coefficient : problem().coefficients) {
    workspace_->field(coefficient.name);
    if (coefficient.value.formula) continue;
    const std::optional<std::vector<double>> values =
        load_coefficient(*this, coefficient, coefficient.value, source, sink);
    if (!values) return false;
    workspace_->set_dense(coefficient.name, *values);
  }
  for (const model::Coefficient& coefficient : problem().coefficients) {
    if (!coefficient.is_control() || !coefficient.value.formula) continue;
    workspace_->run_for_intervals(*compiled_->program(compiled_->names.controls.at(coefficient.name)),
                                  coefficient.name);
  }
  reset_coefficients();
  return true;
}

void Session::reset_coefficients() {
  const dpde_program* program = compiled_->program(compiled_->names.coefficients);
  if (program != nullptr) workspace_->run(*program, problem().t_begin);
}

bool Session::load_states(const SourceFile& source, DiagnosticSink& sink) {
  for (const model::State& state : problem().states) {
    if (state.initial.file.empty()) continue;
    if (options_.made_up) {
      state_files_[state.name] = made_up_values(workspace_->cell_count());
      continue;
    }
    const std::vector<model::Axis> axes = model::axes_at(problem().axes, state.placement);
    std::optional<std::vector<double>> values = load_array(state.initial, source, axes, problem().scheme.real, sink);
    if (!values) return false;
    if (!options_.cells.empty()) values = resample(*values, problem().axes, workspace_->axes());
    state_files_[state.name] = std::move(*values);
  }
  return true;
}

void Session::set_values(Rollout& rollout) const {
  for (const auto& [name, value] : workspace_->params()) rollout.set_param(name, value);
  for (const auto& [name, control] : workspace_->controls()) rollout.set_control(name, control.every, control.values);
}

void Session::reset_initial() {
  set_values(*rollout_);
  const dpde_program* program = compiled_->program(compiled_->names.initial);
  if (program != nullptr) workspace_->run(*program, problem().t_begin);
  for (int s = 0; s < rollout_->state_count(); ++s) {
    const std::string& name = rollout_->state_name(s);
    const auto file = state_files_.find(name);
    if (file != state_files_.end()) {
      rollout_->initial(s).copy_in(file->second);
    } else {
      copy_interior(workspace_->layout(), rollout_->initial(s).base(),
                    {&workspace_->layout(), workspace_->field(name).base()});
    }
  }
  if (program != nullptr) workspace_->release(*program);
}

RolloutSetup Session::setup() {
  RolloutSetup setup;
  setup.step = compiled_->program(compiled_->step_name());
  setup.layout = workspace_->layout();
  setup.steps = steps_;
  setup.t0 = problem().t_begin;
  setup.dt = problem().step;
  setup.rate = compiled_->program(compiled_->names.rate);
  if (setup.rate != nullptr) setup.courant = problem().courant;
  setup.team = workspace_->team();
  setup.checkpoint_bytes = options_.checkpoint_bytes;
  setup.slots = options_.slots;
  setup.checkpoint_folder = options_.checkpoint_folder;
  setup.stop = options_.stop;
  std::set<std::string> states;
  for (const model::State& state : problem().states) states.insert(state.name);
  for (const std::string& name : workspace_->field_names()) {
    if (!states.contains(name)) setup.fields.push_back({name, workspace_->field(name).base()});
  }
  setup.control_fields = workspace_->control_fields();
  for (const auto& [name, value] : workspace_->params()) setup.params.push_back({name, value});
  for (const auto& [name, weights] : workspace_->weights()) {
    setup.weights.push_back(
        {name, weights.values.data(), weights.rates.data(), compiled_->activity.params.contains(name)});
  }
  // All programs share one list of parameters: seeds and directions of derivatives are 0 unless somebody sets them.
  for (int p = 0; p < setup.step->param_count; ++p) {
    const std::string name = setup.step->params[p];
    if (!workspace_->params().contains(name) && name != "t") setup.params.push_back({name, 0.0});
  }
  return setup;
}

bool Session::make_rollout(DiagnosticSink& sink) {
  RolloutSetup full = setup();
  full.adjoint = compiled_->adjoint_of(compiled_->step_name());
  for (const model::Coefficient& coefficient : problem().coefficients) {
    if (compiled_->activity.fields.contains(coefficient.name)) full.sought.push_back(coefficient.name);
  }
  const auto pick = [&](const std::string& name) {
    return LossPrograms{compiled_->program(name), compiled_->adjoint_of(name), "loss"};
  };
  if (!add_losses(full, pick, sink)) return false;
  full.tuning = tuning_ = find_tuning(*compiled_, full);
  rollout_ = std::make_unique<Rollout>(std::move(full));
  return true;
}

/// What the rollout has found out is kept for the next one.
Session::~Session() {
  if (rollout_ == nullptr) return;
  try {
    const std::string found = rollout_->tuning();
    if (found != tuning_) keep_tuning(*compiled_, setup(), found);
  } catch (const std::exception&) {  // a cache is no promise, and the run is over
  }
}

std::unique_ptr<Rollout> Session::second_order_rollout(bool gauss_newton) {
  const auto step = compiled_->derived.find(compiled_->step_name());
  if (step == compiled_->derived.end() || !step->second.second) return nullptr;
  std::vector<std::string> sought = rollout_->sought();
  for (const std::string& name : rollout_->sought()) {
    const std::string rate = rate_of(*compiled_, adjoint::Link::Kind::field, name);
    if (rate.empty()) continue;
    workspace_->make_like(rate, name);
    sought.push_back(rate);
  }
  RolloutSetup both = setup();
  both.step = compiled_->program(step->second.tangent->program);
  both.adjoint = compiled_->program(step->second.second->program);
  both.sought = std::move(sought);
  const auto pick = [&](const std::string& name) -> LossPrograms {
    const auto found = compiled_->derived.find(name);
    if (found == compiled_->derived.end()) return {};
    const Derived& loss = found->second;
    const std::optional<adjoint::Derivative>& value = gauss_newton ? loss.squares : loss.tangent;
    const std::optional<adjoint::Derivative>& adjoint = gauss_newton ? loss.squares_adjoint : loss.second;
    if (!value || !adjoint) return {};
    return {compiled_->program(value->program), compiled_->program(adjoint->program), *value->sum("loss")};
  };
  DiagnosticSink silent;  // the first rollout has reported what data are missing
  if (!add_losses(both, pick, silent)) return nullptr;
  return std::make_unique<Rollout>(std::move(both));
}

bool Session::add_losses(RolloutSetup& setup, const PickLoss& pick, DiagnosticSink& sink) {
  if (!problem().task) return true;
  const model::Task& task = *problem().task;
  for (std::size_t i = 0; i < task.losses.size(); ++i) {
    const LossPrograms programs = pick(compiled_->names.losses[i]);
    if (programs.value == nullptr) return false;
    LossTerm term;
    term.loss = programs.value;
    term.adjoint = programs.adjoint;
    term.sum = programs.sum;
    term.at_steps = steps_of(task.losses[i].when);
    for (const DataStates& datum : data_) {
      if (!is_field(*term.loss, datum.name)) continue;
      LossData data{datum.name, {}};
      for (const int step : term.at_steps) {
        data.at.push_back(datum_at(datum, time_of(step)));
        if (data.at.back() != nullptr) continue;
        sink.report("data-without-time", task.losses[i].origin.range, {datum.name, fmt::format("{}", time_of(step))});
        return false;
      }
      if (datum.fields.size() == 1) data.at.resize(1);
      term.data.push_back(std::move(data));
    }
    setup.losses.push_back(std::move(term));
  }
  return true;
}

void* Session::datum_at(const DataStates& datum, double t) {
  if (datum.times.empty()) return workspace_->field(datum.fields[0]).base();
  for (std::size_t k = 0; k < datum.times.size(); ++k) {
    if (std::abs(datum.times[k] - t) < 1e-6 * problem().step) return workspace_->field(datum.fields[k]).base();
  }
  return nullptr;
}

std::vector<double> Session::initial(int state) {
  std::vector<double> values(workspace_->cell_count());
  rollout_->initial(state).copy_out(values);
  return values;
}

std::vector<double> Session::final_state(int state) {
  std::vector<double> values(workspace_->cell_count());
  copy_out(workspace_->layout(), rollout_->final_states()[static_cast<std::size_t>(state)], values);
  return values;
}

std::map<std::string, void*> Session::bind_states(const std::vector<void*>& states) {
  std::map<std::string, void*> bound;
  for (int s = 0; s < rollout_->state_count(); ++s)
    bound[rollout_->state_name(s)] = states[static_cast<std::size_t>(s)];
  return bound;
}

double Session::evaluate(const dpde_program& program, const std::string& sum, double t,
                         const std::vector<void*>& states) {
  return evaluate(program, sum, t, bind_states(states));
}

double Session::evaluate(const dpde_program& program, const std::string& sum, double t,
                         std::map<std::string, void*> bound) {
  for (const DataStates& datum : data_) {
    if (is_field(program, datum.name)) bound[datum.name] = datum_at(datum, t);
    if (is_field(program, datum.name) && bound[datum.name] == nullptr) return NAN;
  }
  const std::map<std::string, double> sums = workspace_->run(program, t, bound);
  const auto value = sums.find(sum);
  return value == sums.end() ? 0 : value->second;
}

std::vector<std::pair<std::string, double>> Session::observe(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.observe);
  std::vector<std::pair<std::string, double>> values;
  if (program == nullptr) return values;
  const std::map<std::string, double> sums = workspace_->run(*program, t, bind_states(states));
  for (const model::Quantity& quantity : problem().observables) {
    const auto sum = sums.find(quantity.name);
    values.emplace_back(quantity.name, sum == sums.end() ? 0 : sum->second);
  }
  return values;
}

std::vector<ErrorNorms> Session::errors(double t, const std::vector<void*>& states) {
  const dpde_program* program = compiled_->program(compiled_->names.exact);
  std::vector<ErrorNorms> norms;
  if (program == nullptr) return norms;
  workspace_->run(*program, t);
  std::vector<double> computed(workspace_->cell_count());
  // The program keeps one field for each state with an exact solution, in the order of the states.
  auto kept = compiled_->stencil.find_program(compiled_->names.exact)->keeps.begin();
  for (const model::State& state : problem().states) {
    const int index = rollout_->state_index(state.name);
    if (!state.exact) continue;
    const std::vector<double> exact = workspace_->dense(*kept++);
    if (index < 0) continue;
    copy_out(workspace_->layout(), states[static_cast<std::size_t>(index)], computed);
    ErrorNorms norm{state.name};
    for (std::size_t i = 0; i < computed.size(); ++i) {
      const double error = std::abs(computed[i] - exact[i]);
      norm.l1 += error;
      norm.l2 += error * error;
      norm.linf = error > norm.linf || std::isnan(error) ? error : norm.linf;
    }
    norm.l1 /= static_cast<double>(computed.size());
    norm.l2 = std::sqrt(norm.l2 / static_cast<double>(computed.size()));
    norms.push_back(norm);
  }
  workspace_->release(*program);
  return norms;
}

void report_error(const std::exception& error, DiagnosticSink& sink) {
  if (const Error* known = dynamic_cast<const Error*>(&error)) {
    switch (known->kind()) {
      case ErrorKind::input: sink.report("bad-option", {}, {known->what()}); return;
      case ErrorKind::run: sink.report("run-failed", {}, {known->what()}); return;
      case ErrorKind::machine: sink.report("machine-failed", {}, {known->what()}); return;
    }
  }
  const bool memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  sink.report("machine-failed", {}, {memory ? std::string("not enough memory") : std::string(error.what())});
}

namespace {

/// Of the interior; nothing of the size of the field is made.
double largest_magnitude(const dpde_layout& layout, const void* base) {
  double largest = 0;
  const auto look = [&](const auto* values) {
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        const auto* row = values + index_of(layout, 0, y, z);
        for (std::int64_t x = 0; x < layout.cells[0]; ++x)
          largest = std::max(largest, std::abs(static_cast<double>(row[x])));
      }
    }
  };
  layout.real == DPDE_F32 ? look(static_cast<const float*>(base)) : look(static_cast<const double*>(base));
  return largest;
}

double first_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(), session.rollout().initial(state).base());
}
double last_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(),
                           session.rollout().final_states()[static_cast<std::size_t>(state)]);
}

/// The largest magnitudes of the states one step behind the end of the run; infinite where they are no longer finite.
std::vector<double> one_step_further(Session& session) {
  RolloutSetup setup = session.setup();
  setup.steps = 1;
  setup.t0 = session.end_time();
  Rollout further(std::move(setup));
  session.set_values(further);
  for (int s = 0; s < further.state_count(); ++s) further.initial(s).copy_in(session.final_state(s));
  const bool ends = further.run().blow_up.has_value();
  std::vector<double> result;
  for (int s = 0; s < further.state_count(); ++s) {
    const void* const last = further.final_states()[static_cast<std::size_t>(s)];
    result.push_back(ends ? std::numeric_limits<double>::infinity()
                          : largest_magnitude(session.workspace().layout(), last));
  }
  return result;
}

}  // namespace

std::vector<Growth> growth_of(Session& session, double suspicious) {
  std::vector<Growth> result;
  std::vector<double> further;
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const Growth growth{session.rollout().state_name(s), first_magnitude(session, s), last_magnitude(session, s)};
    if (growth.before == 0 || growth.after <= suspicious * growth.before) continue;
    if (further.empty()) further = one_step_further(session);
    // What is unstable grows by the same factor in each step; what began with next to nothing, and other fields drive,
    // does not.
    const double again = std::log(further[static_cast<std::size_t>(s)] / growth.after) * session.steps();
    if (again >= 0.5 * std::log(growth.after / growth.before)) result.push_back(growth);
  }
  return result;
}

void report_growth(Session& session, DiagnosticSink& sink) {
  for (const Growth& growth : growth_of(session)) {
    const model::State* state = session.problem().find_state(growth.state);
    sink.report("grown", state == nullptr ? SourceRange{} : state->origin.range,
                {growth.state, fmt::format("{:.3g}", growth.before), fmt::format("{:.3g}", growth.after)},
                fmt::format("the step of scene {} is {}", session.problem().scene, session.problem().step));
  }
}

namespace {

/// The states that the equation of `state` reads, and those that theirs read.
std::set<std::string> read_by(const model::Problem& problem, const std::string& state) {
  std::set<std::string> found;
  std::vector<std::string> open{state};
  while (!open.empty()) {
    const model::State* reader = problem.find_state(open.back());
    open.pop_back();
    if (reader == nullptr || !reader->rhs) continue;
    for (const model::State& other : problem.states) {
      if (model::reads(*reader->rhs, other.name) && found.insert(other.name).second) open.push_back(other.name);
    }
  }
  return found;
}

/// What overflows first may only read what blows up: "c has grown from 1 to 1e+100, and u reads it; ", of a field that
/// does not read u.
std::string grown_before(Session& session, const std::string& name) {
  constexpr double suspicious = 1e3;
  const model::Problem& problem = session.problem();
  std::string found;
  double most = suspicious;
  for (const std::string& read : read_by(problem, name)) {
    const int s = session.rollout().state_index(read);
    if (s < 0 || read_by(problem, read).contains(name)) continue;
    const double before = first_magnitude(session, s), after = last_magnitude(session, s),
                 growth = after / (before > 0 ? before : 1);
    if (!(growth > most)) continue;
    most = growth;
    found = fmt::format("{} has grown from {:.3g} to {:.3g}, and {} reads it; ", read, before, after, name);
  }
  return found;
}

}  // namespace

void report_blow_up(Session& session, const BlowUp& blow_up, DiagnosticSink& sink) {
  const std::string& name = session.rollout().state_name(blow_up.state);
  const model::State* state = session.problem().find_state(name);
  const SourceRange where = state == nullptr ? SourceRange{} : state->origin.range;
  sink.report(
      "blow-up", where,
      {name, fmt::format("{}", blow_up.step), fmt::format("{}", session.steps()), fmt::format("{:.6g}", blow_up.t),
       session.workspace().cell_text(blow_up.cell), session.workspace().place_text(blow_up.cell)},
      fmt::format("{}the value is {}; a smaller step than {} may help (--set step=...)", grown_before(session, name),
                  shown(blow_up.value), session.problem().step));
}

}  // namespace dpde::driver
