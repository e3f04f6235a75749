// SPDX-License-Identifier: Apache-2.0
// The host interface of a simulation: values in and out, steps. Losses are in simulation_gradient.cpp.
#include "dpde/runtime/simulation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "host/simulation_impl.h"

namespace dpde {
namespace {

constexpr int look_interval = 64;  // steps between checks for values that are not finite: under 1 % of the time

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

template <class Value>
std::vector<std::string> keys_of(const Workspace::Named<Value>& map) {
  std::vector<std::string> names;
  for (const auto& [name, value] : map) names.push_back(name);
  return names;
}

/// The options of the engine. Throws if the scene cannot run with them.
EngineOptions options_of(const dpde_scene& scene, const SimulationOptions& options) {
  for (std::size_t a = 0; a < options.cells.size() && a < static_cast<std::size_t>(scene.rank); ++a) {
    if (scene.axes[a].centres == nullptr || options.cells[a] == scene.axes[a].cells) continue;
    throw Error(
        ErrorKind::input,
        fmt::format(
            "axis {} of scene {} is stretched or runs down: it was compiled for {} cells and runs on no other number",
            scene.axes[a].name, scene.name, scene.axes[a].cells));
  }
  return {options};
}

}  // namespace

void no_such(const dpde_scene& scene, std::string_view kind, std::string_view name,
             const std::vector<std::string>& known) {
  throw Error(ErrorKind::input, fmt::format("scene {} has no {} {}; it has {}", scene.name, kind, name,
                                            known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", "))));
}

Simulation::Impl::Impl(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep)
    : engine(scene, options_of(scene, options), std::move(keep)), gradient_values(engine.unknown_count()) {
  for (int32_t p = 0; p < scene.param_count; ++p) {
    if (!engine.workspace().controls().contains(scene.params[p].name)) param_names.emplace_back(scene.params[p].name);
  }
  for (int32_t c = 0; c < scene.control_count; ++c) control_names.emplace_back(scene.controls[c].name);
  for (std::vector<std::string>* names : {&param_names, &control_names}) std::ranges::sort(*names);
  for (int32_t n = 0; n < scene.network_count; ++n) {
    const dpde_network& network = *scene.networks[n];
    if (network.is_host == 0) continue;
    supplied[network.name] = std::make_unique<SuppliedNetwork>(network, engine.workspace().cell_count());
    engine.set_host(network.name, supplied[network.name]->table());
  }
  engine.stepper();
}

void Simulation::Impl::require_param(std::string_view name) const {
  if (std::ranges::find(param_names, name) == param_names.end())
    no_such(engine.scene(), "parameter", name, param_names);
}

const std::vector<double>& Simulation::Impl::control_named(std::string_view name) const {
  if (std::ranges::find(control_names, name) == control_names.end())
    no_such(engine.scene(), "control", name, control_names);
  return engine.workspace().controls().find(name)->second.values;
}

const std::vector<double>& Simulation::Impl::weights_named(std::string_view name) const {
  const auto& weights = engine.workspace().weights();
  const auto found = weights.find(name);
  if (found == weights.end()) no_such(engine.scene(), "network", name, keys_of(weights));
  return found->second.values;
}

std::size_t Simulation::Impl::state_named(std::string_view name) const {
  const int s = engine.state_index(name);
  if (s >= 0) return static_cast<std::size_t>(s);
  std::vector<std::string> known = names_of(engine.states());
  std::ranges::sort(known);
  no_such(engine.scene(), "state", name, known);
}

const Engine::Given& Simulation::Impl::field_named(std::string_view name) const {
  const auto found = engine.given().find(name);
  if (found == engine.given().end())
    no_such(engine.scene(), "coefficient or data field", name, keys_of(engine.given()));
  return found->second;
}

const Engine::Unknown& Simulation::Impl::unknown_named(std::string_view name) const {
  const auto found = std::ranges::find(engine.unknowns(), name, &Engine::Unknown::name);
  if (found != engine.unknowns().end()) return *found;
  const char* const task = engine.scene().task;
  throw Error(ErrorKind::input, fmt::format("{} is not an unknown of {}", name,
                                            task == nullptr ? "a task" : fmt::format("task {}", task)));
}

void Simulation::Impl::require_finite() {
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    const Field& values = engine.initial(s);
    const std::optional<Cell> bad = find_not_finite(values.layout(), values.base());
    if (!bad) continue;
    throw Error(ErrorKind::run, fmt::format("the initial state of {} is not finite in cell ({}, {}, {})",
                                            engine.states()[s].name, bad->x, bad->y, bad->z));
  }
}

/// Throws unless all fields without a formula have values.
void Simulation::Impl::require_given(bool with_data) {
  const char* const scene = engine.scene().name;
  for (const Engine::State& state : engine.states()) {
    if (state.start != DPDE_START_HOST || state.is_given) continue;
    throw Error(ErrorKind::input, fmt::format("scene {}: the initial state of {} comes from a file; give it with "
                                              "set_initial",
                                              scene, state.name));
  }
  for (const auto& [name, field] : engine.given()) {
    if (!field.is_needed || field.is_given || (field.is_datum && !with_data)) continue;
    throw Error(ErrorKind::input,
                fmt::format("scene {}: {} {} no formula; give {} with set_field", scene, name,
                            field.is_datum ? "are data and have" : "has", field.is_datum ? "them" : "it"));
  }
}

/// Throws if a value replaces a formula that is part of another one, which then does not follow. `initial`: also for
/// formulas of initial states.
void Simulation::Impl::require_followed(bool initial) const {
  const auto is_given = [&](std::string_view name, bool unless_asked) {
    const int state = engine.state_index(name);
    if (state >= 0) return initial ? engine.states()[static_cast<std::size_t>(state)].is_given : unless_asked;
    const auto found = engine.given().find(name);
    return found != engine.given().end() && found->second.is_given;
  };
  const dpde_scene& scene = engine.scene();
  for (const dpde_put_in& part : std::span(scene.put_in, static_cast<std::size_t>(scene.put_in_count))) {
    if (!is_given(part.name, false) || is_given(part.in, true)) continue;
    throw Error(ErrorKind::input,
                fmt::format("scene {0}: {1} is given, but {2} is made of the formula of {1} and does not follow: give "
                            "values of {2}, too",
                            scene.name, part.name, part.in));
  }
}

void Simulation::Impl::begin_stepping() {
  engine.update_formulas();
  require_followed(!has_begun);
  if (has_begun) return;
  require_given(false);
  require_finite();
  Rollout& stepper = engine.stepper();
  engine.begin(stepper);
  stepper.restart();
  began.clear();
  for (std::size_t s = 0; s < engine.states().size(); ++s)
    began.push_back(largest_magnitude(engine.workspace().layout(), stepper.present()[s]));
  of_steps.judged.assign(began.size(), 0.0);
  of_steps.text.clear();
  has_begun = true;
  reached = looked_at = 0;
}

Reached Simulation::Impl::present_state() {
  begin_stepping();
  Reached result{reached, {}, engine.stepper().controller()};
  for (void* state : engine.stepper().present())
    copy_out(engine.workspace().layout(), state, result.states.emplace_back(engine.workspace().cell_count()));
  return result;
}

void Simulation::Impl::go_on_from(const Reached& from) {
  const std::size_t cells = engine.workspace().cell_count();
  const bool fits = from.step >= 0 && from.states.size() == engine.states().size() &&
                    std::ranges::all_of(from.states, [&](const auto& state) { return state.size() == cells; });
  if (!fits)
    throw Error(ErrorKind::input, fmt::format("scene {} goes on from {} states of {} values", engine.scene().name,
                                              engine.states().size(), cells));
  has_begun = false;
  begin_stepping();
  Rollout& stepper = engine.stepper();
  stepper.restart(from.step);
  for (std::size_t s = 0; s < from.states.size(); ++s)
    copy_in(engine.workspace().layout(), stepper.present()[s], from.states[s]);
  stepper.set_controller(from.controller);
  reached = looked_at = from.step;
}

void Simulation::Impl::look_for_blow_up() {
  if (reached == looked_at) return;
  const int before = looked_at;
  looked_at = reached;
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    const std::optional<Cell> bad = find_not_finite(engine.workspace().layout(), engine.stepper().present()[s]);
    if (!bad) continue;
    throw NotFinite(
        fmt::format("{} is no longer finite after {} steps (t = {:.6g}) in cell ({}, {}, {}){}; "
                    "a smaller step than {} may help",
                    engine.states()[s].name, reached, time(), bad->x, bad->y, bad->z,
                    reached - before == 1 ? "" : fmt::format("; it was after {}", before), engine.scene().step));
  }
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    const double now = largest_magnitude(engine.workspace().layout(), engine.stepper().present()[s]);
    if (grows_beyond_reason(began[s], now)) throw NotFinite(text_of({engine.states()[s].name, began[s], now}, reached));
  }
}

std::string Simulation::Impl::text_of(const Growth& growth, int steps) const {
  return fmt::format(
      "{} has grown from {:.3g} to {:.3g} in {} step{}: with these values the step {} may be too large for the scheme",
      growth.state, growth.before, growth.after, steps, steps == 1 ? "" : "s", engine.scene().step);
}

std::string Simulation::Impl::text_of(const std::vector<Growth>& growths, int steps) const {
  std::string text;
  for (const Growth& growth : growths) text += (text.empty() ? "" : "; ") + text_of(growth, steps);
  return text;
}

void Simulation::Impl::look_for_growth() {
  told = &of_steps;
  std::vector<double>& judged = of_steps.judged;
  const std::vector<void*>& present = engine.stepper().present();
  std::vector<double> far(present.size(), 0.0);
  bool is_judged = true;
  for (std::size_t s = 0; s < far.size(); ++s) {
    const double now = largest_magnitude(engine.workspace().layout(), present[s]);
    if (began[s] > 0 && now > suspicious_growth * began[s]) far[s] = now;
    const bool is_known = judged[s] > 0 ? far[s] > 0 && far[s] <= suspicious_growth * judged[s] : far[s] == 0;
    is_judged = is_judged && is_known;
  }
  if (is_judged) return;
  const std::vector<Growth> growths = growths_of(engine, began, present, reached, time());
  for (const Growth& growth : growths) {
    if (growth.is_beyond_reason()) throw NotFinite(text_of(growth, reached));
  }
  of_steps.text = text_of(growths, reached);
  judged = far;
}

/// Returns nothing when stopped.
std::optional<Steady> Simulation::Impl::advance(int count, bool look, bool until_steady) {
  if (count < 0) throw Error(ErrorKind::input, fmt::format("{} steps cannot be made", count));
  begin_stepping();
  Steady last;
  while (count > 0 && !last.is_reached) {
    const int now = std::min(count, look_interval - (reached - looked_at) % look_interval);
    const RunResult done = engine.stepper().advance(now, until_steady);
    reached = done.steps_done;
    if (done.stopped) return std::nullopt;
    last = done.steady.value_or(Steady());
    count -= now;
    if (reached - looked_at >= look_interval) look_for_blow_up();
  }
  if (look) look_for_blow_up();
  return last;
}

bool Simulation::Impl::run_to_step(int step, bool until_steady, const Simulation& host,
                                   const ProgressCallback& progress, int every) {
  begin_stepping();
  const int begin = reached, count = std::max(0, step - begin);
  Steady last;
  while (reached < begin + count && !last.is_reached) {
    const int left = begin + count - reached, now = progress ? std::min(std::max(every, 1), left) : left;
    const std::optional<Steady> made = advance(now, now == left, until_steady);
    if (!made) return false;
    last = *made;
    if (progress && !progress({reached - begin, count, host.time()})) return false;
  }
  if (count == 0) look_for_blow_up();  // checks states that were set
  look_for_growth();
  if (until_steady && last.step > 0 && !last.is_reached) throw not_steady(last, engine.scene().steady);
  return true;
}

void Simulation::Impl::set_control(std::string_view name, Values values) {
  const std::vector<double>& control = control_named(name);
  if (values.size() != control.size()) {
    throw Error(ErrorKind::input,
                fmt::format("control {} needs {} values, not {}", name, control.size(), values.size()));
  }
  engine.set_control(name, values);
}

void Simulation::Impl::set_field(std::string_view name, Values values) {
  const Engine::Given& field = field_named(name);
  const std::size_t states = field.states, cells = engine.workspace().cell_count();
  if (field.is_number && values.size() != states)
    throw Error(ErrorKind::input, fmt::format("{} needs {} values, one a time, not {}", name, states, values.size()));
  if (field.is_number) {
    std::vector<double> everywhere;
    for (const double value : values) everywhere.insert(everywhere.end(), cells, value);
    return engine.set_field(name, everywhere);
  }
  if (values.size() != states * cells) {
    throw Error(ErrorKind::input, fmt::format("{} needs {} values ({} cells, {} times), not {}", name, states * cells,
                                              cells, states, values.size()));
  }
  engine.set_field(name, values);
}

Simulation::Simulation(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep)
    : impl_(std::make_unique<Impl>(scene, options, std::move(keep))) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

std::vector<std::string> Simulation::params() const { return impl_->param_names; }
std::vector<std::string> Simulation::states() const { return names_of(impl_->engine.states()); }
std::vector<std::string> Simulation::unknowns() const { return names_of(impl_->engine.unknowns()); }
std::vector<std::string> Simulation::networks() const { return keys_of(impl_->engine.workspace().weights()); }
const std::vector<std::int64_t>& Simulation::cells() const { return impl_->engine.cells(); }
std::size_t Simulation::size() const { return impl_->engine.workspace().cell_count(); }

const std::shared_ptr<const RunDescription>& Simulation::description() const { return impl_->run; }
void Simulation::describe(std::shared_ptr<const RunDescription> run) { impl_->run = std::move(run); }

std::vector<double> Simulation::coordinates(int axis) const {
  const dpde_scene& scene = impl_->engine.scene();
  if (axis < 0 || axis >= scene.rank)
    throw Error(ErrorKind::input, fmt::format("scene {} has no axis {}", scene.name, axis));
  const dpde_axis& from = scene.axes[axis];
  if (from.centres != nullptr) return {from.centres, from.centres + from.cells};
  std::vector<double> centres(static_cast<std::size_t>(cells()[static_cast<std::size_t>(axis)]));
  for (std::size_t i = 0; i < centres.size(); ++i) {
    centres[i] =
        from.low + (static_cast<double>(i) + 0.5) * (from.high - from.low) / static_cast<double>(centres.size());
  }
  return centres;
}

void Simulation::set(std::string_view name, double value) {
  impl_->require_param(name);
  const dpde_scene& scene = impl_->engine.scene();
  const auto is_fixed = [&](const dpde_value& param) {
    return param.is_fixed != 0 && param.value != value && name == param.name;
  };
  if (std::any_of(scene.params, scene.params + scene.param_count, is_fixed))
    throw Error(
        ErrorKind::input,
        fmt::format("of parameter {} something is made when the scene is compiled, as the grid, a time, a seed, "
                    "a control or another parameter: give its value there, among the settings, or write let in "
                    "place of a parameter that is made of it",
                    name));
  impl_->engine.set_param(name, value);
}

double Simulation::param(std::string_view name) const {
  impl_->require_param(name);
  return impl_->engine.workspace().params().find(name)->second;
}

void Simulation::set_control(std::string_view name, Values values) {
  const bool is_field = impl_->engine.workspace().find_control_field(name) != nullptr;
  is_field ? impl_->set_field(name, values) : impl_->set_control(name, values);
}

std::span<const double> Simulation::control(std::string_view name) const { return impl_->control_named(name); }

void Simulation::set_weights(std::string_view network, Values values) {
  const std::size_t count = impl_->weights_named(network).size();
  if (values.size() != count)
    throw Error(ErrorKind::input,
                fmt::format("network {} has {} weights, {} are given", network, count, values.size()));
  impl_->engine.set_weights(network, values);
}

std::vector<double> Simulation::weights(std::string_view network) const { return impl_->weights_named(network); }

void Simulation::supply(std::string_view network, HostNetwork functions) {
  impl_->weights_named(network);  // throws with the known names
  const auto own = impl_->supplied.find(network);
  if (own == impl_->supplied.end())
    throw Error(
        ErrorKind::input,
        fmt::format("network {} has layers of its own: a host supplies those that say `host` in place of layers",
                    network));
  own->second->supply(std::move(functions));
  impl_->engine.set_host(network, own->second->table());
}

void Simulation::set_state(std::string_view name, Values values) {
  const std::size_t s = impl_->state_named(name);
  impl_->explained([&] { impl_->begin_stepping(); });
  void* const present = impl_->engine.stepper().present()[s];
  const dpde_layout& layout = impl_->engine.workspace().layout();
  copy_in(layout, present, values);
  impl_->began[s] = std::max(impl_->began[s], largest_magnitude(layout, present));
}

void Simulation::set_initial(std::string_view name, Values values) {
  impl_->engine.set_initial(impl_->state_named(name), values);
}

void Simulation::set_field(std::string_view name, Values values) { impl_->set_field(name, values); }

std::vector<std::string> Simulation::fields() const { return keys_of(impl_->engine.given()); }

std::size_t Simulation::field_size(std::string_view name) const {
  const Engine::Given& field = impl_->field_named(name);
  return field.is_number ? field.states : field.states * size();
}

bool Simulation::is_number(std::string_view name) const { return impl_->field_named(name).is_number; }

void Simulation::state(std::string_view name, Target to) const {
  const std::size_t s = impl_->state_named(name);
  impl_->explained([&] { impl_->begin_stepping(); });
  impl_->look_for_blow_up();
  copy_out(impl_->engine.workspace().layout(), impl_->engine.stepper().present()[s], to);
}

std::vector<double> Simulation::state(std::string_view name) const {
  std::vector<double> values(size());
  state(name, values);
  return values;
}

std::vector<double> Simulation::initial(std::string_view name) {
  const std::size_t s = impl_->state_named(name);
  impl_->engine.update_formulas();
  std::vector<double> values(size());
  impl_->engine.initial(s).copy_out(values);
  return values;
}

const std::string& Simulation::growth() const { return impl_->told->text; }

double Simulation::time() const { return impl_->time(); }
double Simulation::time_step() const { return impl_->engine.scene().step; }
int Simulation::steps_done() const { return impl_->reached; }
std::deque<SolveNote> Simulation::solve_notes() const { return impl_->engine.stepper().solve_notes(); }

Reached Simulation::reached() {
  return impl_->explained([&] { return impl_->present_state(); });
}

void Simulation::go_on_from(const Reached& reached) {
  const Running running(impl_->is_running);
  impl_->explained([&] { impl_->go_on_from(reached); });
}

void Simulation::begin_at(double time) {
  impl_->engine.begin_at(time);
  impl_->has_begun = false;
}

void Simulation::reset() {
  const Running running(impl_->is_running);
  impl_->has_begun = false;
  impl_->explained([&] { impl_->begin_stepping(); });
}

bool Simulation::step(int count) {
  const Running running(impl_->is_running);
  return impl_->explained([&] { return impl_->advance(count, count >= look_interval, false).has_value(); });
}

bool Simulation::run_to(double time, const ProgressCallback& progress, int every) {
  const Running running(impl_->is_running);
  const double begin = impl_->engine.t_begin(), step = time_step(), position = (time - begin) / step;
  if (!(position < std::numeric_limits<int>::max()))
    throw Error(ErrorKind::input, fmt::format("cannot run to t = {}", time));
  // A time is accurate to a few units in its last place: far from t = 0 this is a larger part of a step than 1e-6.
  constexpr double roundings = 4 * std::numeric_limits<double>::epsilon();
  const double instant = roundings * std::max(std::abs(time), std::abs(begin)) / step;
  const double tolerance = std::min(0.5, 1e-6 + instant);
  const int last = static_cast<int>(std::ceil(std::max(position - tolerance, 0.0)));
  return impl_->explained([&] { return impl_->run_to_step(last, false, *this, progress, every); });
}

/// Runs the scene's number of steps, which is not recomputed from times.
bool Simulation::run(const ProgressCallback& progress, int every) {
  const Running running(impl_->is_running);
  return impl_->explained([&] {
    const dpde_scene& scene = impl_->engine.scene();
    return impl_->run_to_step(scene.steps, scene.steady > 0, *this, progress, every);
  });
}

}  // namespace dpde
