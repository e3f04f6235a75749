// SPDX-License-Identifier: Apache-2.0
// Construction of a simulation, and what its rollouts are made of.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "dpde/runtime/error.h"
#include "dpde/runtime/links.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/random.h"
#include "simulation_impl.h"

namespace dpde {
namespace {

bool has_input(const dpde_program& program, std::string_view name) {
  return std::any_of(program.fields, program.fields + program.input_count,
                     [&](const char* field) { return name == field; });
}

template <class Map>
[[noreturn]] void no_such(const dpde_scene& scene, std::string_view kind, std::string_view name, const Map& known) {
  std::vector<std::string> names;
  for (const auto& [each, value] : known) names.push_back(each);
  throw Error(ErrorKind::input, fmt::format("scene {} has no {} {}; it has {}", scene.name, kind, name,
                                            names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

}  // namespace

Simulation::Impl::Impl(const dpde_scene& from, const SimulationOptions& wanted, std::shared_ptr<const void> code)
    : scene(from), options(wanted), team(options.threads), keep(std::move(code)) {
  if (scene.version != DPDE_SCENE_VERSION) {
    throw Error(ErrorKind::run, fmt::format("scene {} was compiled for version {} of the runtime, this is {}",
                                            scene.name, scene.version, DPDE_SCENE_VERSION));
  }
  make_layout(wanted);
  make_params();
  make_fields();
  make_unknowns();
  stepper.emplace(setup());
  give_controls(*stepper);
}

std::vector<const dpde_program*> Simulation::Impl::programs() const {
  std::vector<const dpde_program*> all{scene.program,
                                       scene.adjoint,
                                       scene.initial,
                                       scene.initial_adjoint,
                                       scene.coefficient_formulas,
                                       scene.coefficient_adjoint,
                                       scene.start,
                                       scene.observe,
                                       scene.rate};
  for (int32_t i = 0; i < scene.loss_count; ++i) {
    const dpde_loss& loss = scene.losses[i];
    all.insert(all.end(), {loss.loss, loss.adjoint, loss.full.tangent, loss.full.adjoint, loss.squares.tangent,
                           loss.squares.adjoint});
  }
  for (const dpde_second& second : {scene.second, scene.initial_second, scene.coefficient_second})
    all.insert(all.end(), {second.tangent, second.adjoint});
  std::erase(all, nullptr);
  return all;
}

void Simulation::Impl::make_layout(const SimulationOptions& wanted) {
  const auto rank = static_cast<size_t>(scene.rank);
  for (size_t a = 0; a < rank; ++a)
    cells.push_back(wanted.cells.empty() ? scene.axes[a].cells : wanted.cells[std::min(a, wanted.cells.size() - 1)]);
  if (!wanted.cells.empty() && wanted.cells.size() != rank) {
    throw Error(ErrorKind::input,
                fmt::format("scene {} has {} axes, cells are given for {}", scene.name, rank, wanted.cells.size()));
  }
  for (size_t a = 0; a < rank; ++a) {
    if (scene.axes[a].centres == nullptr || cells[a] == scene.axes[a].cells) continue;
    throw Error(
        ErrorKind::input,
        fmt::format("axis {} of scene {} is stretched: it was compiled for {} cells and runs on no other number",
                    scene.axes[a].name, scene.name, scene.axes[a].cells));
  }
  std::array<int64_t, 3> halo{};
  for (const dpde_program* program : programs()) {
    for (size_t a = 0; a < 3; ++a) halo[a] = std::max(halo[a], program->halo[a]);
  }
  layout = dpde::make_layout(cells, halo, scene.program->real);
  size = static_cast<std::size_t>(cell_count(layout));
}

void Simulation::Impl::make_params() {
  for (int32_t p = 0; p < scene.param_count; ++p) scene_params[scene.params[p].name] = scene.params[p].value;
  params = scene_params;
  for (int32_t c = 0; c < scene.control_count; ++c) {
    const dpde_control& control = scene.controls[c];
    controls[control.name].assign(control.values, control.values + control.count);
    scene_params.erase(control.name);  // set_control is for them
  }
  constexpr const char* spacings[] = {"hx", "hy", "hz"};
  for (size_t a = 0; a < cells.size(); ++a) {
    const dpde_axis& axis = scene.axes[a];
    params[spacings[a]] = (axis.high - axis.low) / static_cast<double>(cells[a]);
    fill_coordinate(field(axis.name), static_cast<int>(a), axis.low, params[spacings[a]], axis.is_periodic != 0);
  }
  params["dt"] = scene.step;
  params["cells"] = static_cast<double>(size);
  // All programs share one list of parameters: seeds and directions of derivatives are 0 unless somebody sets them.
  for (int32_t p = 0; p < scene.program->param_count; ++p) {
    const std::string_view name = scene.program->params[p];
    if (name != "t") params.emplace(name, 0.0);
  }
}

void Simulation::Impl::make_fields() {
  for (int32_t n = 0; n < scene.network_count; ++n) {
    const dpde_network& network = *scene.networks[n];
    const double* given = scene.weights[n];
    weights[network.name] =
        given ? std::vector<double>(given, given + network.weight_count) : initial_weights(network, network.seed);
    if (network.is_host != 0) supplied[network.name] = std::make_unique<SuppliedNetwork>(network, size);
  }
  for (int32_t c = 0; c < scene.coefficient_count; ++c) {
    const dpde_coefficient& coefficient = scene.coefficients[c];
    field(coefficient.name);
    HostField& host = host_fields[coefficient.name];
    host.is_needed = coefficient.has_formula == 0;
    if (coefficient.every == 0) continue;
    host.states = coefficient.count;
    host.every = coefficient.every;
    make_control_field(coefficient.name, coefficient.every, coefficient.count);
  }
  draw_noise(0);
  for (int32_t d = 0; d < scene.datum_count; ++d) {
    const dpde_datum& datum = scene.data[d];
    const int64_t states = datum.at.count == 0 ? 1 : static_cast<int64_t>(steps_of(datum.at).size());
    for (int64_t k = 0; k < states; ++k) state_of(datum.name, k);
    host_fields[datum.name] = {false, true, states};
  }
  for (int32_t s = 0; s < scene.program->swap_count; ++s) {  // in the order of the rollouts' states
    InitialState& state = initial_states.emplace_back();
    state.name = scene.program->fields[scene.program->swaps[s].state];
    for (int32_t i = 0; i < scene.state_count; ++i) {
      if (state.name == scene.states[i].name && scene.states[i].has_formula == 0) state.start = DPDE_START_HOST;
    }
    initial.emplace_back(layout, s);
  }
}

/// What the tangents, which agree on it, call the rate of a value; "" where none of them varies by it.
std::string_view Simulation::Impl::rate_of(int32_t kind, std::string_view name) const {
  const auto rate = [&](const dpde_program* tangent) {
    return tangent == nullptr ? std::string_view() : rate_in(*tangent, kind, name);
  };
  for (const dpde_program* tangent :
       {scene.second.tangent, scene.coefficient_second.tangent, scene.initial_second.tangent}) {
    if (!rate(tangent).empty()) return rate(tangent);
  }
  for (int32_t i = 0; i < scene.loss_count; ++i) {
    if (!rate(scene.losses[i].full.tangent).empty()) return rate(scene.losses[i].full.tangent);
  }
  return "";
}

std::string_view Simulation::Impl::rate_of(const dpde_unknown& unknown) const {
  const bool is_field = unknown.kind == DPDE_UNKNOWN_INITIAL || unknown.kind == DPDE_UNKNOWN_COEFFICIENT;
  return rate_of(is_field ? DPDE_LINK_FIELD : DPDE_LINK_PARAM, unknown.name);
}

void Simulation::Impl::make_unknowns() {
  for (int32_t u = 0; u < scene.unknown_count; ++u) {
    const dpde_unknown& unknown = scene.unknowns[u];
    const bool is_initial = unknown.kind == DPDE_UNKNOWN_INITIAL;
    const int state = is_initial ? state_named(unknown.name) : -1;
    std::size_t count = unknown.kind == DPDE_UNKNOWN_PARAM ? 1 : size;
    if (unknown.kind == DPDE_UNKNOWN_NETWORK) count = weights_named(unknown.name).size();
    if (unknown.kind == DPDE_UNKNOWN_CONTROL) count = control_named(unknown.name).size();
    if (unknown.kind == DPDE_UNKNOWN_COEFFICIENT)
      count = size * static_cast<std::size_t>(host_field_named(unknown.name).states);
    unknowns.push_back({unknown.name, std::string(rate_of(unknown)), unknown.kind, unknown.low, unknown.high,
                        gradient_values.size(), count});
    gradient_values.resize(gradient_values.size() + count);
    const auto seek = [&](auto& field) {
      field.is_unknown = true;
      if (unknown.start != DPDE_START_SCENE) field.start = unknown.start;
    };
    if (is_initial) seek(initial_states[static_cast<size_t>(state)]);
    if (unknown.kind != DPDE_UNKNOWN_COEFFICIENT) continue;
    HostField& coefficient = host_field_named(unknown.name);
    seek(coefficient);
    if (unknown.start != DPDE_START_SCENE) coefficient.is_needed = unknown.start == DPDE_START_HOST;
  }
}

Field& Simulation::Impl::field(std::string_view name) {
  const auto found = fields.find(name);
  if (found != fields.end()) return *found->second;
  return *fields.emplace(name, std::make_unique<Field>(layout, static_cast<int>(fields.size()))).first->second;
}

Field& Simulation::Impl::state_of(std::string_view name, int64_t number) {
  return number == 0 ? field(name) : field(fmt::format("{}@{}", name, number));
}

void Simulation::Impl::make_control_field(std::string_view name, int32_t every, int32_t count) {
  if (std::ranges::find(control_fields, name, &ControlField::name) != control_fields.end()) return;
  ControlField& control = control_fields.emplace_back(ControlField{std::string(name), every, {}});
  for (int32_t k = 0; k < count; ++k) control.at.push_back(state_of(name, k).base());
}

void Simulation::Impl::draw_noise(std::uint64_t interval) {
  for (int32_t n = 0; n < scene.noise_count; ++n)
    fill_noise(layout, field(scene.noises[n].name).base(), scene.noises[n].seed, interval);
}

RolloutSetup Simulation::Impl::setup() const {
  RolloutSetup setup;
  setup.step = scene.program;
  setup.layout = layout;
  setup.steps = scene.steps;
  setup.t0 = t_begin;
  setup.dt = scene.step;
  setup.rate = scene.rate;
  if (scene.rate != nullptr) setup.courant = scene.courant;
  setup.team = team;
  setup.checkpoint_bytes = options.checkpoint_bytes;
  setup.slots = options.slots;
  setup.stop = options.stop;
  for (const auto& [name, field] : fields) {
    const auto is_it = [&](const InitialState& state) { return state.name == name; };
    if (std::none_of(initial_states.begin(), initial_states.end(), is_it))
      setup.fields.push_back({name, field->base()});
  }
  setup.control_fields = control_fields;
  for (const auto& [name, value] : params) setup.params.push_back({name, value});
  for (const auto& [name, values] : weights) {
    const auto is_learned = [&](const Unknown& unknown) { return unknown.is_network() && unknown.name == name; };
    setup.weights.push_back({name, values.data(), nullptr, std::ranges::any_of(unknowns, is_learned), host_of(name)});
  }
  return setup;
}

std::vector<int> Simulation::Impl::steps_of(const dpde_instants& instants) const {
  if (instants.count >= 0) return {instants.steps, instants.steps + instants.count};
  std::vector<int> all(static_cast<size_t>(scene.steps) + 1);
  for (size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
  return all;
}

void* Simulation::Impl::datum_at(const dpde_datum& datum, int step) {
  if (datum.at.count == 0) return field(datum.name).base();
  const std::vector<int> steps = steps_of(datum.at);
  const auto found = std::ranges::find(steps, step);
  if (found == steps.end()) {
    throw Error(ErrorKind::input, fmt::format("data {} hold no state after step {}", datum.name, step));
  }
  const auto k = found - steps.begin();
  return state_of(datum.name, k).base();
}

/// `program` is the loss, or what takes its place.
LossTerm Simulation::Impl::loss_term(const dpde_loss& loss, const dpde_program& program) {
  LossTerm term;
  term.loss = &program;
  term.adjoint = loss.adjoint;
  term.at_steps = steps_of(loss.at);
  for (int32_t d = 0; d < scene.datum_count; ++d) {
    const dpde_datum& datum = scene.data[d];
    if (!has_input(program, datum.name)) continue;
    LossData data{datum.name, {}};
    for (const int step : term.at_steps) data.at.push_back(datum_at(datum, step));
    if (datum.at.count == 0) data.at.resize(1);
    term.data.push_back(std::move(data));
  }
  return term;
}

Rollout& Simulation::Impl::objective() {
  if (scene.task == nullptr)
    throw Error(ErrorKind::input, fmt::format("scene {} was compiled without a task: it has no loss", scene.name));
  if (!losses) {
    RolloutSetup full = setup();
    full.adjoint = scene.adjoint;
    for (int32_t i = 0; i < scene.loss_count; ++i)
      full.losses.push_back(loss_term(scene.losses[i], *scene.losses[i].loss));
    full.cut = options.cut;
    full.seconds = options.seconds;
    full.sought.assign(scene.sought, scene.sought + scene.sought_count);
    losses.emplace(std::move(full));
    give_controls(*losses);
    losses->watch_gradient(watch, watch_every);
  }
  return *losses;
}

double& Simulation::Impl::param_named(std::string_view name) {
  const auto found = scene_params.find(name);
  if (found == scene_params.end()) no_such(scene, "parameter", name, scene_params);
  return found->second;
}

std::vector<double>& Simulation::Impl::control_named(std::string_view name) {
  const auto found = controls.find(name);
  if (found == controls.end()) no_such(scene, "control", name, controls);
  return found->second;
}

const dpde_host_network* Simulation::Impl::host_of(std::string_view network) const {
  const auto found = supplied.find(network);
  return found == supplied.end() ? nullptr : found->second->table();
}

std::vector<double>& Simulation::Impl::weights_named(std::string_view name) {
  const auto found = weights.find(name);
  if (found == weights.end()) no_such(scene, "network", name, weights);
  return found->second;
}

void Simulation::Impl::give_controls(Rollout& rollout) const {
  for (int32_t c = 0; c < scene.control_count; ++c) {
    rollout.set_control(scene.controls[c].name, scene.controls[c].every,
                        controls.find(std::string_view(scene.controls[c].name))->second);
  }
}

int Simulation::Impl::state_named(std::string_view name) const {
  const auto found = std::ranges::find(initial_states, name, &InitialState::name);
  if (found == initial_states.end()) {
    std::map<std::string, bool> known;
    for (const InitialState& state : initial_states) known[state.name] = true;
    no_such(scene, "state", name, known);
  }
  return static_cast<int>(found - initial_states.begin());
}

HostField& Simulation::Impl::host_field_named(std::string_view name) {
  const auto found = host_fields.find(name);
  if (found == host_fields.end()) no_such(scene, "coefficient or data field", name, host_fields);
  return found->second;
}

}  // namespace dpde
