// SPDX-License-Identifier: Apache-2.0
// Construction of an engine, and its rollouts.
#include "dpde/runtime/engine.h"

#include <fmt/format.h>

#include <algorithm>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/links.h"

namespace dpde {
namespace {

template <class Map>
auto& find(Map& map, std::string_view name) {
  return map.find(name)->second;
}

}  // namespace

Engine::Engine(const dpde_scene& scene, EngineOptions options, std::shared_ptr<const void> keep)
    : scene_(scene), options_(std::move(options)), keep_(std::move(keep)) {
  if (scene_.version != DPDE_SCENE_VERSION) {
    throw Error(ErrorKind::run, fmt::format("scene {} was compiled for version {} of the runtime, this is {}",
                                            scene_.name, scene_.version, DPDE_SCENE_VERSION));
  }
  formulas_ = formula_programs();
  make_workspace();
  make_fields();
  make_unknowns();
}

std::vector<const dpde_program*> Engine::programs() const {
  std::vector<const dpde_program*> all{scene_.program,
                                       scene_.adjoint,
                                       scene_.initial_adjoint,
                                       scene_.coefficient_adjoint,
                                       scene_.observe,
                                       scene_.output_program,
                                       scene_.rate,
                                       scene_.trial,
                                       scene_.watched,
                                       scene_.watched_step};
  for (int32_t i = 0; i < scene_.adjoint_variant_count; ++i)
    all.insert(all.end(), {scene_.adjoint_variants[i].adjoint, scene_.adjoint_variants[i].step});
  all.insert(all.end(), formulas_.begin(), formulas_.end());
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    const dpde_loss& loss = scene_.losses[i];
    all.insert(all.end(), {loss.loss, loss.adjoint, loss.full.tangent, loss.full.adjoint, loss.gauss_newton.tangent,
                           loss.gauss_newton.adjoint});
  }
  for (const dpde_second& second : {scene_.second, scene_.initial_second, scene_.coefficient_second})
    all.insert(all.end(), {second.tangent, second.adjoint});
  std::erase(all, nullptr);
  return all;
}

std::vector<const dpde_program*> Engine::formula_programs() const {
  std::vector<const dpde_program*> all{scene_.initial, scene_.coefficient_formulas, scene_.start};
  for (int32_t c = 0; c < scene_.coefficient_count; ++c) all.push_back(scene_.coefficients[c].formula);
  std::erase(all, nullptr);
  return all;
}

void Engine::make_workspace() {
  const auto rank = static_cast<std::size_t>(scene_.rank);
  if (!options_.cells.empty() && options_.cells.size() != rank) {
    throw Error(ErrorKind::input,
                fmt::format("scene {} has {} axes, cells are given for {}", scene_.name, rank, options_.cells.size()));
  }
  std::array<std::int64_t, 3> halo = options_.halo;
  for (const dpde_program* program : programs()) {
    for (std::size_t a = 0; a < 3; ++a) halo[a] = std::max(halo[a], program->halo[a]);
  }
  Workspace::Setup setup;
  for (std::size_t a = 0; a < rank; ++a) {
    const dpde_axis& axis = scene_.axes[a];
    cells_.push_back(options_.cells.empty() ? axis.cells : options_.cells[a]);
    setup.axes.push_back(
        {axis.name, axis.low, (axis.high - axis.low) / static_cast<double>(cells_[a]), axis.is_periodic != 0});
  }
  const int32_t real = scene_.program->real;
  setup.ranks = options_.ranks;
  setup.layout = setup.ranks == nullptr ? make_layout(cells_, halo, real)
                                        : make_subgrid(cells_, setup.ranks->ranks(), setup.ranks->place(), halo, real);
  setup.team = Team(options_.threads);
  setup.count = options_.count;
  setup.t_begin = scene_.t_begin;
  setup.step = scene_.step;
  for (int32_t p = 0; p < scene_.param_count; ++p)
    setup.params.push_back({scene_.params[p].name, scene_.params[p].value});
  for (int32_t c = 0; c < scene_.control_count; ++c) {
    const dpde_control& control = scene_.controls[c];
    setup.controls[control.name] = {control.every, {control.values, control.values + control.count}};
  }
  for (int32_t n = 0; n < scene_.noise_count; ++n)
    setup.noises.push_back({scene_.noises[n].name, scene_.noises[n].seed});
  workspace_.emplace(std::move(setup));
}

void Engine::make_fields() {
  for (int32_t n = 0; n < scene_.network_count; ++n) workspace_->add_weights(*scene_.networks[n], scene_.weights[n]);
  for (int32_t c = 0; c < scene_.coefficient_count; ++c) {
    const dpde_coefficient& coefficient = scene_.coefficients[c];
    workspace_->field(coefficient.name);
    Given& given = given_[coefficient.name];
    given.is_needed = coefficient.has_formula == 0;
    if (coefficient.every == 0) continue;
    given.states = static_cast<std::size_t>(coefficient.count);
    workspace_->add_control_field(coefficient.name, coefficient.every, given.states);
  }
  for (int32_t d = 0; d < scene_.datum_count; ++d) {
    const dpde_datum& datum = scene_.data[d];
    const Datum& made =
        data_.emplace_back(Datum{datum.name, datum.at.count == 0 ? std::vector<int>{} : steps_of(datum.at)});
    given_[datum.name] = {true, false, true, std::max<std::size_t>(made.at.size(), 1)};
    given_[datum.name].is_number = datum.is_number != 0;
  }
  for (int32_t s = 0; s < scene_.program->swap_count; ++s) {  // in the order of the rollouts' states
    State& state = states_.emplace_back();
    state.name = scene_.program->fields[scene_.program->swaps[s].state];
    for (int32_t i = 0; i < scene_.state_count; ++i) {
      if (state.name == scene_.states[i].name && scene_.states[i].has_formula == 0) state.start = DPDE_START_HOST;
    }
  }
}

void Engine::make_unknowns() {
  std::size_t numbers = 0;
  for (int32_t u = 0; u < scene_.unknown_count; ++u) {
    const dpde_unknown& unknown = scene_.unknowns[u];
    std::size_t size = unknown.kind == DPDE_UNKNOWN_PARAM ? 1 : workspace_->cell_count();
    if (unknown.kind == DPDE_UNKNOWN_NETWORK) size = find(workspace_->weights(), unknown.name).values.size();
    if (unknown.kind == DPDE_UNKNOWN_CONTROL) size = find(workspace_->controls(), unknown.name).values.size();
    if (unknown.kind == DPDE_UNKNOWN_COEFFICIENT) size *= find(given_, unknown.name).states;
    const bool is_field = unknown.kind == DPDE_UNKNOWN_INITIAL || unknown.kind == DPDE_UNKNOWN_COEFFICIENT;
    unknowns_.push_back({unknown.name, std::string(rate_of(is_field ? DPDE_LINK_FIELD : DPDE_LINK_PARAM, unknown.name)),
                         unknown.kind, unknown.low, unknown.high, unknown_count_, size});
    unknown_count_ += size;
    numbers += is_field ? 0 : size;
    const auto seek = [&](auto& field) {
      field.is_unknown = true;
      if (unknown.start != DPDE_START_SCENE) field.start = unknown.start;
    };
    if (unknown.kind == DPDE_UNKNOWN_INITIAL) seek(states_[static_cast<std::size_t>(state_index(unknown.name))]);
    if (unknown.kind != DPDE_UNKNOWN_COEFFICIENT) continue;
    Given& coefficient = find(given_, unknown.name);
    seek(coefficient);
    if (unknown.start != DPDE_START_SCENE) coefficient.is_needed = unknown.start == DPDE_START_HOST;
  }
  first_numbers_.reserve(numbers);
}

int Engine::state_index(std::string_view name) const {
  const auto found = std::ranges::find(states_, name, &State::name);
  return found == states_.end() ? -1 : static_cast<int>(found - states_.begin());
}

RolloutSetup Engine::setup() {
  const Workspace& from = *workspace_;
  RolloutSetup setup;
  setup.step = scene_.program;
  setup.layout = from.layout();
  setup.steps = scene_.steps;
  setup.steady = scene_.steady;
  setup.t0 = from.t_begin();
  setup.dt = scene_.step;
  setup.solvers = from.solvers();
  setup.rate = scene_.rate;
  if (scene_.rate != nullptr) {
    setup.courant = scene_.courant;
    setup.rate_field = scene_.rate_field;
  }
  setup.trial = scene_.trial;
  if (scene_.trial != nullptr) {
    setup.error_order = scene_.control.order;
    setup.first_part = scene_.control.first;
  }
  setup.team = from.team();
  setup.ranks = options_.ranks;
  setup.checkpoint_bytes = options_.checkpoint_bytes;
  setup.slots = options_.slots;
  setup.checkpoint_folder = options_.checkpoint_folder;
  setup.stop = options_.stop;
  setup.fields = workspace_->bound_fields();
  std::erase_if(setup.fields, [&](const BoundField& field) { return state_index(field.name) >= 0; });
  setup.control_fields = from.control_fields();
  for (const auto& [name, value] : from.params()) setup.params.push_back({name, value});
  // All programs share one list of parameters: seeds and directions of derivatives are 0 unless they are set.
  for (int32_t p = 0; p < scene_.program->param_count; ++p) {
    const std::string_view name = scene_.program->params[p];
    if (name != "t" && !from.params().contains(name)) setup.params.push_back({std::string(name), 0.0});
  }
  for (const auto& [name, weights] : from.weights()) {
    const bool is_learned = find_unknown(DPDE_UNKNOWN_NETWORK, name) != nullptr;
    setup.weights.push_back({name, weights.values.data(), weights.rates.data(), is_learned, weights.host});
  }
  return setup;
}

std::vector<int> Engine::steps_of(const dpde_instants& instants) const {
  if (instants.count >= 0) return {instants.steps, instants.steps + instants.count};
  std::vector<int> all(static_cast<std::size_t>(scene_.steps) + 1);
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
  return all;
}

/// `program` is the loss or the program that replaces it, such as its tangent.
LossTerm Engine::loss_term(const dpde_loss& loss, const dpde_program& program) {
  const auto is_input = [&](const std::string& name) {
    return std::any_of(program.fields, program.fields + program.input_count,
                       [&](const char* field) { return name == field; });
  };
  LossTerm term;
  term.loss = &program;
  term.adjoint = loss.adjoint;
  if (!loss.of_averages) term.at_steps = steps_of(loss.at);
  term.weight = loss.weight;
  if (loss.average != nullptr) term.average = loss.average;
  term.of_averages = loss.of_averages != 0;
  for (const Datum& datum : data_) {
    if (!is_input(datum.name)) continue;
    LossData data{datum.name, {}};
    for (const int step : term.at_steps) {
      const auto found = std::ranges::find(datum.at, step);
      if (!datum.at.empty() && found == datum.at.end()) {
        if (options_.count != nullptr) continue;  // no values are read
        throw Error(ErrorKind::input, fmt::format("data {} hold no state after step {}", datum.name, step));
      }
      const std::size_t number = datum.at.empty() ? 0 : static_cast<std::size_t>(found - datum.at.begin());
      data.at.push_back(workspace_->field(datum.name, number).base());
    }
    if (datum.at.empty()) data.at.resize(1);
    term.data.push_back(std::move(data));
  }
  return term;
}

/// The first rollout holds the initial state, the others get it when they begin.
Rollout& Engine::open(std::optional<Rollout>& rollout, RolloutSetup setup) {
  rollout.emplace(std::move(setup));
  give_controls(*rollout);
  rollout->watch_gradient(watch_, watch_every_);
  return *rollout;
}

Rollout& Engine::stepper() {
  if (stepper_) return *stepper_;
  RolloutSetup forward = setup();
  if (options_.find_tuning) forward.tuning = options_.find_tuning(forward);
  open(stepper_, std::move(forward));
  if (primary_ == nullptr) primary_ = &*stepper_;
  return *stepper_;
}

RolloutSetup Engine::objective_setup() {
  if (scene_.task == nullptr)
    throw Error(ErrorKind::input, fmt::format("scene {} was compiled without a task: it has no loss", scene_.name));
  RolloutSetup full = setup();
  full.adjoint = scene_.adjoint;
  full.adjoint_variants.assign(scene_.adjoint_variants, scene_.adjoint_variants + scene_.adjoint_variant_count);
  for (int32_t i = 0; i < scene_.loss_count; ++i)
    full.losses.push_back(loss_term(scene_.losses[i], *scene_.losses[i].loss));
  full.cut = options_.cut;
  full.seconds = options_.seconds;
  full.sought.assign(scene_.sought, scene_.sought + scene_.sought_count);
  return full;
}

Rollout& Engine::objective() {
  if (losses_) return *losses_;
  RolloutSetup full = objective_setup();
  if (options_.find_tuning) full.tuning = options_.find_tuning(full);
  open(losses_, std::move(full));
  if (primary_ == nullptr) primary_ = &*losses_;
  return *losses_;
}

void Engine::give_controls(Rollout& rollout) const {
  for (const auto& [name, control] : workspace_->controls()) rollout.set_control(name, control.every, control.values);
}

void Engine::begin(Rollout& rollout) {
  update_formulas();
  Rollout& from = primary();
  if (&rollout == &from) return;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const int to = rollout.state_index(states_[s].name);
    if (to >= 0) copy_all(workspace_->layout(), rollout.initial(to).base(), from.initial(static_cast<int>(s)).base());
  }
}

void Engine::begin_other(Rollout& rollout) {
  for (const auto& [name, value] : workspace_->params()) {
    if (name != "dt") rollout.set_param(name, value);  // dt stays that of its setup
  }
  give_controls(rollout);
  begin(rollout);
}

void Engine::watch_gradients(GradientCallback watch, int every) {
  watch_ = std::move(watch);
  watch_every_ = every;
  for_each_rollout([&](Rollout& rollout) { rollout.watch_gradient(watch_, watch_every_); });
}

void Engine::begin_at(double time) {
  workspace_->begin_at(time);
  formulas_are_stale_ = true;
  held_are_stale_ = !first_numbers_.empty();
  for_each_rollout([&](Rollout& rollout) { rollout.set_begin(time); });
}

}  // namespace dpde
