// SPDX-License-Identifier: Apache-2.0
// What a host asks of a simulation: values in and out, steps. Losses are in simulation_gradient.cpp.
#include "dpde/runtime/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "simulation_impl.h"

namespace dpde {
namespace {

constexpr int look_interval = 64;  // steps between looks for values that are not finite: under 1 % of the time

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

}  // namespace

/// 0 for what nobody sets, as seeds of derivatives.
double Simulation::Impl::param_at(std::string_view name, double t) const {
  if (name == "t") return t;
  for (int32_t c = 0; c < scene.control_count; ++c) {
    if (name != scene.controls[c].name) continue;
    const std::vector<double>& values = controls.find(name)->second;
    return values[interval_at(t, scene.controls[c].every, values.size())];
  }
  const auto value = params.find(name);
  return value == params.end() ? 0 : value->second;
}

std::size_t Simulation::Impl::interval_at(double t, int every, std::size_t count) const {
  return control_interval(std::llround((t - t_begin) / scene.step), every, count);
}

void* Simulation::Impl::field_at(std::string_view name, double t) {
  const auto control = std::ranges::find(control_fields, name, &ControlField::name);
  return control == control_fields.end() ? field(name).base()
                                         : control->at[interval_at(t, control->every, control->at.size())];
}

void Simulation::Impl::copy_in_all(std::string_view name, Values values) {
  for (std::size_t k = 0; k * size < values.size(); ++k)
    state_of(name, static_cast<int64_t>(k)).copy_in(values.subspan(k * size, size));
}

void Simulation::Impl::copy_out_all(std::string_view name, Target to) {
  for (std::size_t k = 0; k * size < to.size(); ++k)
    state_of(name, static_cast<int64_t>(k)).copy_out(to.subspan(k * size, size));
}

const Executor& Simulation::Impl::execute(const dpde_program& program, double t) {
  auto found = executors.find(&program);
  if (found == executors.end()) {
    found = executors.emplace(&program, Executor(program, layout, team)).first;
    for (int f = 0; f < program.field_count; ++f) found->second.bind(f, field(program.fields[f]).base());
  }
  Executor& executor = found->second;
  for (const ControlField& control : control_fields) {
    const int f = executor.field_index(control.name);
    if (f >= 0) executor.bind(f, field_at(control.name, t));
  }
  for (int p = 0; p < program.param_count; ++p) {
    executor.set_param(p, param_at(program.params[p], t));
  }
  for (int n = 0; n < program.network_count; ++n) {
    const char* name = program.networks[n]->name;
    std::vector<double>& values = weights_named(name);
    std::vector<double>& bars = formula_bars[name];
    bars.assign(values.size(), 0.0);
    executor.bind_weights(n, {values.data(), nullptr, bars.data(), host_of(name)});
  }
  executor.update_weights();
  executor.update_uniforms();
  executor.prepare();
  executor.run();
  return executor;
}

/// Coefficients with formulas, except those the host gave, and initial states.
void Simulation::Impl::update_formulas() {
  if (!formulas_are_stale) return;
  formulas_are_stale = false;
  const auto has_formula = [](const dpde_coefficient& coefficient) { return coefficient.formula != nullptr; };
  const bool has_any = scene.coefficient_formulas != nullptr ||
                       std::any_of(scene.coefficients, scene.coefficients + scene.coefficient_count, has_formula);
  if (!has_any && !needs_initial()) return;
  keeping_given([&] {
    update_control_fields();
    if (scene.coefficient_formulas != nullptr) execute(*scene.coefficient_formulas);
    update_initial();  // and where the task's coefficients start
  });
}

/// Windows of trajectories begin anew again and again, each with states of the data: their formulas may cost as much as
/// many steps.
bool Simulation::Impl::needs_initial() const {
  return scene.start != nullptr || !std::ranges::all_of(initial_states, &InitialState::is_given);
}

/// By their formulas, interval by interval; noise is drawn anew in each.
void Simulation::Impl::update_control_fields() {
  bool drew = false;
  for (int32_t c = 0; c < scene.coefficient_count; ++c) {
    const dpde_coefficient& control = scene.coefficients[c];
    if (control.formula == nullptr || host_field_named(control.name).is_given) continue;
    Executor program(*control.formula, layout, team);
    for (int f = 0; f < control.formula->field_count; ++f) program.bind(f, field(control.formula->fields[f]).base());
    const int result = program.field_index(control.name);
    for (int32_t k = 0; k < control.count; ++k) {
      draw_noise(static_cast<std::uint64_t>(k));
      drew = true;
      program.bind(result, state_of(control.name, k).base());
      const double middle = t_begin + (k + 0.5) * control.every * scene.step;
      for (int p = 0; p < control.formula->param_count; ++p)
        program.set_param(p, param_at(control.formula->params[p], middle));
      program.update_uniforms();
      program.prepare();
      program.run();
    }
  }
  if (drew) draw_noise(0);
}

void Simulation::Impl::update_initial() {
  if (!needs_initial()) return;
  std::vector<double> values(size);
  const auto take = [&](int32_t start) {
    for (size_t s = 0; s < initial_states.size(); ++s) {
      if (initial_states[s].is_given || initial_states[s].start != start) continue;
      field(initial_states[s].name).copy_out(values);
      initial[s].copy_in(values);
    }
  };
  if (scene.initial != nullptr) execute(*scene.initial);
  take(DPDE_START_SCENE);
  if (scene.start != nullptr) execute(*scene.start);
  take(DPDE_START_FORMULA);
}

void Simulation::Impl::require_finite(const Field& values, const std::string& name) const {
  const std::optional<Cell> bad = find_not_finite(layout, values.base());
  if (!bad) return;
  throw Error(ErrorKind::run,
              fmt::format("the initial state of {} is not finite in cell ({}, {}, {})", name, bad->x, bad->y, bad->z));
}

/// Everything without a formula must have been given.
void Simulation::Impl::require_host_fields(bool with_data) const {
  for (size_t s = 0; s < initial_states.size(); ++s) {
    const InitialState& state = initial_states[s];
    if (state.start == DPDE_START_HOST && !state.is_given) {
      throw Error(ErrorKind::input,
                  fmt::format("scene {}: the initial state of {} comes from a file; give it with set_initial",
                              scene.name, state.name));
    }
    require_finite(initial[s], state.name);
  }
  for (const auto& [name, host] : host_fields) {
    const bool is_datum =
        std::any_of(scene.data, scene.data + scene.datum_count, [&](const dpde_datum& d) { return name == d.name; });
    if (!host.is_needed || host.is_given || (is_datum && !with_data)) continue;
    throw Error(ErrorKind::input, fmt::format("scene {}: {} {} no formula; give {} with set_field", scene.name, name,
                                              is_datum ? "are data and have" : "has", is_datum ? "them" : "it"));
  }
}

void Simulation::Impl::begin_stepping() {
  update_formulas();
  if (has_begun) return;
  require_host_fields(false);
  for (size_t s = 0; s < initial.size(); ++s) {
    Field& to = stepper->initial(static_cast<int>(s));
    copy_all(layout, to.base(), initial[s].base());
  }
  stepper->restart();
  has_begun = true;
  reached = looked_at = 0;
}

void Simulation::Impl::look_for_blow_up() {
  if (reached == looked_at) return;
  const int before = looked_at;
  looked_at = reached;
  for (size_t s = 0; s < initial_states.size(); ++s) {
    const std::optional<Cell> bad = find_not_finite(layout, stepper->present()[s]);
    if (!bad) continue;
    throw NotFinite(
        fmt::format("{} is no longer finite after {} steps (t = {:.6g}) in cell ({}, {}, {}){}; "
                    "a smaller step than {} may help",
                    initial_states[s].name, reached, t_begin + reached * scene.step, bad->x, bad->y, bad->z,
                    reached - before == 1 ? "" : fmt::format("; it was after {}", before), scene.step));
  }
}

bool Simulation::Impl::advance(int count, bool look) {
  begin_stepping();
  while (count > 0) {
    const int now = std::min(count, look_interval - (reached - looked_at) % look_interval);
    const RunResult done = stepper->advance(now);
    reached = done.steps_done;
    if (done.stopped) return false;
    count -= now;
    if (reached - looked_at >= look_interval) look_for_blow_up();
  }
  if (look) look_for_blow_up();
  return true;
}

Simulation::Simulation(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep)
    : impl_(std::make_unique<Impl>(scene, options, std::move(keep))) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

std::vector<std::string> Simulation::params() const {
  std::vector<std::string> names;
  for (const auto& [name, value] : impl_->scene_params) names.push_back(name);
  return names;
}
std::vector<std::string> Simulation::states() const { return names_of(impl_->initial_states); }
std::vector<std::string> Simulation::unknowns() const { return names_of(impl_->unknowns); }
const std::vector<std::int64_t>& Simulation::cells() const { return impl_->cells; }
std::size_t Simulation::size() const { return impl_->size; }

std::vector<double> Simulation::coordinates(int axis) const {
  if (axis < 0 || axis >= impl_->scene.rank)
    throw Error(ErrorKind::input, fmt::format("scene {} has no axis {}", impl_->scene.name, axis));
  const auto a = static_cast<size_t>(axis);
  const dpde_axis& from = impl_->scene.axes[a];
  if (from.centres != nullptr) return {from.centres, from.centres + from.cells};
  std::vector<double> centres(static_cast<size_t>(impl_->cells[a]));
  for (size_t i = 0; i < centres.size(); ++i) {
    centres[i] =
        from.low + (static_cast<double>(i) + 0.5) * (from.high - from.low) / static_cast<double>(centres.size());
  }
  return centres;
}

void Simulation::Impl::set_param(std::string_view name, double value) {
  param_named(name) = value;
  params.find(name)->second = value;
  for (std::optional<Rollout>* rollout : {&stepper, &losses, &full, &gauss_newton}) {
    if (*rollout) (*rollout)->set_param(name, value);
  }
  formulas_are_stale = true;
}

void Simulation::Impl::set_control(std::string_view name, Values values) {
  std::vector<double>& control = control_named(name);
  if (values.size() != control.size()) {
    throw Error(ErrorKind::input,
                fmt::format("control {} needs {} values, not {}", name, control.size(), values.size()));
  }
  control.assign(values.begin(), values.end());
  for (std::optional<Rollout>* rollout : {&stepper, &losses, &full, &gauss_newton}) {
    if (*rollout) give_controls(**rollout);
  }
}

void Simulation::set(std::string_view name, double value) { impl_->set_param(name, value); }
void Simulation::set_control(std::string_view name, Values values) {
  const auto is_it = [&](const ControlField& control) { return control.name == name; };
  if (std::ranges::any_of(impl_->control_fields, is_it)) return set_field(name, values);
  impl_->set_control(name, values);
}
void Simulation::Impl::set_weights(std::string_view network, Values values) {
  std::vector<double>& own = weights_named(network);
  if (values.size() != own.size())
    throw Error(ErrorKind::input,
                fmt::format("network {} has {} weights, {} are given", network, own.size(), values.size()));
  if (own.empty() || std::memcmp(values.data(), own.data(), own.size() * sizeof(double)) == 0)
    return;  // whoever runs next takes them as they are
  std::ranges::copy(values, own.begin());
  stepper->update_weights();
  const auto applies_networks = [](const dpde_program* formulas) {
    return formulas != nullptr && formulas->network_count > 0;
  };
  const bool is_read =
      applies_networks(scene.coefficient_formulas) || applies_networks(scene.initial) || applies_networks(scene.start);
  formulas_are_stale = formulas_are_stale || is_read;
}
void Simulation::set_weights(std::string_view network, Values values) { impl_->set_weights(network, values); }

void Simulation::supply(std::string_view network, HostNetwork functions) {
  impl_->weights_named(network);  // or an error that says which there are
  const auto own = impl_->supplied.find(network);
  if (own == impl_->supplied.end())
    throw Error(
        ErrorKind::input,
        fmt::format("network {} has layers of its own: a host supplies those that say `host` in place of layers",
                    network));
  own->second->supply(std::move(functions));
  impl_->formulas_are_stale = true;
}

std::vector<double> Simulation::weights(std::string_view network) const { return impl_->weights_named(network); }

std::vector<std::string> Simulation::networks() const {
  std::vector<std::string> names;
  for (const auto& [name, values] : impl_->weights) names.push_back(name);
  return names;
}

std::span<const double> Simulation::control(std::string_view name) const { return impl_->control_named(name); }

double Simulation::param(std::string_view name) const { return impl_->param_named(name); }

void Simulation::set_state(std::string_view name, Values values) {
  const auto s = static_cast<size_t>(impl_->state_named(name));
  impl_->begin_stepping();
  copy_in(impl_->layout, impl_->stepper->present()[s], values);
}

void Simulation::set_initial(std::string_view name, Values values) {
  const auto s = static_cast<size_t>(impl_->state_named(name));
  impl_->initial[s].copy_in(values);
  impl_->initial_states[s].is_given = true;
}

void Simulation::set_field(std::string_view name, Values values) {
  HostField& host = impl_->host_field_named(name);
  const auto wanted = static_cast<size_t>(host.states) * impl_->size;
  if (values.size() != wanted) {
    throw Error(ErrorKind::input, fmt::format("{} needs {} values ({} cells, {} times), not {}", name, wanted,
                                              impl_->size, host.states, values.size()));
  }
  impl_->copy_in_all(name, values);
  host.is_given = true;
  impl_->formulas_are_stale = true;
}

void Simulation::state(std::string_view name, Target to) const {
  const auto s = static_cast<size_t>(impl_->state_named(name));
  impl_->begin_stepping();
  impl_->look_for_blow_up();
  copy_out(impl_->layout, impl_->stepper->present()[s], to);
}

std::vector<double> Simulation::state(std::string_view name) const {
  std::vector<double> values(impl_->size);
  state(name, values);
  return values;
}

std::vector<double> Simulation::initial(std::string_view name) {
  const auto s = static_cast<size_t>(impl_->state_named(name));
  impl_->update_formulas();
  std::vector<double> values(impl_->size);
  impl_->initial[s].copy_out(values);
  return values;
}

void Simulation::Impl::begin_at(double time) {
  t_begin = time;
  formulas_are_stale = true;
  has_begun = false;
  for (std::optional<Rollout>* rollout : {&stepper, &losses, &full, &gauss_newton}) {
    if (*rollout) (*rollout)->set_begin(time);
  }
}

double Simulation::Impl::observe(std::string_view name) {
  begin_stepping();
  const dpde_program* program = scene.observe;
  int sum = -1;
  for (int32_t s = 0; program != nullptr && s < program->sum_count; ++s) {
    if (name == program->sums[s]) sum = s;
  }
  if (sum < 0) throw Error(ErrorKind::input, fmt::format("scene {} has no observable {}", scene.name, name));
  for (size_t s = 0; s < initial_states.size(); ++s) {
    copy_all(layout, field(initial_states[s].name).base(), stepper->present()[s]);
  }
  return execute(*program, t_begin + reached * scene.step).sums()[static_cast<size_t>(sum)];
}

double Simulation::observe(std::string_view name) { return impl_->observe(name); }

double Simulation::time() const { return impl_->t_begin + impl_->reached * impl_->scene.step; }
double Simulation::time_step() const { return impl_->scene.step; }
void Simulation::begin_at(double time) { impl_->begin_at(time); }
int Simulation::steps_done() const { return impl_->reached; }

void Simulation::reset() {
  impl_->has_begun = false;
  impl_->begin_stepping();
}

bool Simulation::step(int count) { return impl_->advance(count, false); }

bool Simulation::Impl::run_to_step(int step, const Simulation& host, const ProgressCallback& progress, int every) {
  const int count = std::max(0, step - (has_begun ? reached : 0));
  if (!progress) return advance(count, true);
  for (int done = 0; done < count;) {
    const int now = std::min(std::max(every, 1), count - done);
    if (!advance(now, done + now == count)) return false;
    done += now;
    if (!progress({done, count, host.time()})) return false;
  }
  return true;
}

bool Simulation::run_to(double time, const ProgressCallback& progress, int every) {
  const double position = (time - impl_->t_begin) / impl_->scene.step;
  if (!(position < std::numeric_limits<int>::max()))
    throw Error(ErrorKind::input, fmt::format("cannot run to t = {}", time));
  // A time is known to a few units in its last place: far from t = 0 these are more of a step than anything else.
  constexpr double roundings = 4 * std::numeric_limits<double>::epsilon();
  const double instant = roundings * std::max(std::abs(time), std::abs(impl_->t_begin)) / impl_->scene.step;
  const double tolerance = std::min(0.5, 1e-6 + instant);
  return impl_->run_to_step(static_cast<int>(std::ceil(std::max(position - tolerance, 0.0))), *this, progress, every);
}

/// The number of steps is the scene's: no time is taken apart for it.
bool Simulation::run(const ProgressCallback& progress, int every) {
  return impl_->run_to_step(impl_->scene.steps, *this, progress, every);
}

double Simulation::loss() {
  Rollout& objective = impl_->objective();
  impl_->begin_objective(objective);
  const double loss = objective.loss();
  const bool stopped = impl_->options.stop != nullptr && impl_->options.stop->load();
  if (!stopped && !std::isfinite(loss)) impl_->refuse(objective, "the loss");
  return loss;
}

}  // namespace dpde
