// SPDX-License-Identifier: Apache-2.0
// Values that an engine is given, formulas that depend on them, and the unknowns among them as one vector.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "dpde/runtime/engine.h"

namespace dpde {
namespace {

bool has_param(const dpde_program& program, std::string_view name) {
  return std::any_of(program.params, program.params + program.param_count,
                     [&](const char* param) { return name == param; });
}

bool has_input(const dpde_program& program, std::string_view name) {
  return std::any_of(program.fields, program.fields + program.input_count,
                     [&](const char* field) { return name == field; });
}

bool has_network(const dpde_program& program, std::string_view name) {
  return std::any_of(program.networks, program.networks + program.network_count,
                     [&](const dpde_network* network) { return name == network->name; });
}

}  // namespace

/// Marks formulas that read the value as outdated. Before an unknown that formulas read changes for the first time,
/// unknown fields are fixed to their first guesses. Later changes of other values update them, with the unknowns as
/// they were then.
void Engine::before_change(std::string_view name, bool (*reads)(const dpde_program&, std::string_view)) {
  if (std::ranges::none_of(formulas_, [&](const dpde_program* formula) { return reads(*formula, name); })) return;
  const bool is_sought = std::ranges::find(unknowns_, name, &Unknown::name) != unknowns_.end();
  const auto moves = [](const auto& field) { return field.is_unknown && !field.is_given; };
  const bool any_moves = std::ranges::any_of(states_, moves) ||
                         std::ranges::any_of(given_, [&](const auto& named) { return moves(named.second); });
  if (is_sought && any_moves && first_numbers_.empty()) {
    update_formulas();
    hold_sought(true);
    add_sought_numbers(first_numbers_);
  }
  formulas_are_stale_ = true;
  held_are_stale_ = held_are_stale_ || (!is_sought && !first_numbers_.empty());
}

void Engine::hold_sought(bool holds) {
  for (State& state : states_) state.is_held = holds && state.is_unknown;
  for (auto& [name, given] : given_) given.is_held = holds && given.is_unknown;
}

void Engine::add_sought_numbers(std::vector<double>& to) const {
  for (const Unknown& unknown : unknowns_) {
    const auto add = [&](const std::vector<double>& values) { to.insert(to.end(), values.begin(), values.end()); };
    if (unknown.kind == DPDE_UNKNOWN_PARAM) to.push_back(workspace_->params().find(unknown.name)->second);
    if (unknown.kind == DPDE_UNKNOWN_CONTROL) add(workspace_->controls().find(unknown.name)->second.values);
    if (unknown.is_network()) add(workspace_->weights().find(unknown.name)->second.values);
  }
}

/// For formulas only: does not update rollouts.
void Engine::put_sought_numbers(Values numbers) {
  for (const Unknown& unknown : unknowns_) {
    if (unknown.is_field()) continue;
    const Values own = numbers.first(unknown.size);
    numbers = numbers.subspan(unknown.size);
    if (unknown.kind == DPDE_UNKNOWN_PARAM) workspace_->set_param(unknown.name, own[0]);
    if (unknown.kind == DPDE_UNKNOWN_CONTROL)
      workspace_->set_control(unknown.name, workspace_->controls().find(unknown.name)->second.every, own);
    if (unknown.is_network()) std::ranges::copy(own, workspace_->weights().find(unknown.name)->second.values.begin());
  }
}

void Engine::set_param(std::string_view name, double value) {
  const auto now = workspace_->params().find(name);
  if (now == workspace_->params().end() || now->second != value) before_change(name, has_param);
  workspace_->set_param(name, value);
  for_each_rollout([&](Rollout& rollout) { rollout.set_param(name, value); });
}

void Engine::set_control(std::string_view name, Values values) {
  const Workspace::Control& now = workspace_->controls().find(name)->second;
  if (!std::ranges::equal(now.values, values)) before_change(name, has_param);
  const Workspace::Control& control = workspace_->set_control(name, now.every, values);
  for_each_rollout([&](Rollout& rollout) { rollout.set_control(name, control.every, control.values); });
}

void Engine::set_weights(std::string_view network, Values values) {
  std::vector<double>& own = workspace_->weights().find(network)->second.values;
  if (own.empty() || std::memcmp(values.data(), own.data(), own.size() * sizeof(double)) == 0)
    return;  // nothing to update
  before_change(network, has_network);
  std::ranges::copy(values, own.begin());
  if (stepper_) stepper_->update_weights();
}

void Engine::set_host(std::string_view network, const dpde_host_network* functions) {
  workspace_->weights().find(network)->second.host = functions;
  formulas_are_stale_ = true;
}

void Engine::set_initial(std::size_t state, Values values) {
  initial(state).copy_in(values);
  states_[state].is_given = true;
}

void Engine::set_field(std::string_view name, Values values) {
  before_change(name, has_input);
  Given& given = given_.find(name)->second;
  for (std::size_t k = 0, size = workspace_->cell_count(); k < given.states; ++k)
    workspace_->field(name, k).copy_in(values.subspan(k * size, size));
  given.is_given = true;
}

void Engine::take_datum(std::string_view name, std::vector<int> at) {
  const auto given = given_.find(name);
  if (given == given_.end()) return;  // no loss reads it
  given->second.is_given = true;
  given->second.states = std::max<std::size_t>(at.size(), 1);
  std::ranges::find(data_, name, &Datum::name)->at = std::move(at);
}

/// Whether a program of formulas has a field to compute that was not given. Training samples restart again and
/// again, each with states from the data, and formulas of states may cost as much as many steps.
bool Engine::formulas_need(const dpde_program& program, int32_t start) const {
  return std::any_of(program.fields + program.input_count, program.fields + program.field_count, [&](const char* name) {
    const int s = state_index(name);
    const auto given = given_.find(std::string_view(name));
    if (s < 0) return given != given_.end() && !given->second.is_kept();
    const State& state = states_[static_cast<std::size_t>(s)];
    return !state.is_kept() && state.start == start;
  });
}

void* Engine::unused(std::size_t number) {
  while (unused_.size() <= number) unused_.push_back(workspace_->make_field());
  return unused_[number]->base();
}

/// States with this kind of start are written to the initial state; given values stay.
void Engine::run_formulas(const dpde_program& program, int32_t start) {
  if (!formulas_need(program, start)) return;
  Workspace::Bound bound;
  std::size_t left_out = 0;
  const auto leave_out = [&](const char* name) { bound[name] = unused(left_out++); };
  bool has_states = false;
  for (int f = program.input_count; f < program.field_count; ++f) {
    const char* const name = program.fields[f];
    const int s = state_index(name);
    const auto given = given_.find(std::string_view(name));
    if (s >= 0) {
      has_states = true;
      const State& state = states_[static_cast<std::size_t>(s)];
      const bool is_wanted = !state.is_kept() && state.start == start;
      if (is_wanted) bound[name] = options_.count != nullptr ? nullptr : initial(static_cast<std::size_t>(s)).base();
      if (!is_wanted) leave_out(name);
    } else if (given != given_.end() && given->second.is_kept()) {
      leave_out(name);
    }
  }
  workspace_->execute(program, t_begin(), bound);
  for (int f = program.input_count; has_states && f < program.field_count; ++f) {
    if (!given_.contains(std::string_view(program.fields[f]))) workspace_->release(program.fields[f]);
  }
}

void Engine::update_formulas() {
  if (!formulas_are_stale_) return;
  formulas_are_stale_ = false;
  if (std::exchange(held_are_stale_, false)) {
    std::vector<double> now;
    add_sought_numbers(now);
    put_sought_numbers(first_numbers_);
    hold_sought(false);
    run_all_formulas();
    hold_sought(true);
    put_sought_numbers(now);
  }
  run_all_formulas();
  workspace_->release_coordinates();
}

void Engine::run_all_formulas() {
  for (int32_t c = 0; c < scene_.coefficient_count; ++c) {
    const dpde_coefficient& control = scene_.coefficients[c];
    if (control.formula == nullptr || given_.find(std::string_view(control.name))->second.is_kept()) continue;
    workspace_->run_for_intervals(*control.formula, control.name);
  }
  if (scene_.coefficient_formulas != nullptr) run_formulas(*scene_.coefficient_formulas, DPDE_START_SCENE);
  if (scene_.initial != nullptr) run_formulas(*scene_.initial, DPDE_START_SCENE);
  if (scene_.start != nullptr) run_formulas(*scene_.start, DPDE_START_FORMULA);
}

void Engine::values_of(const Unknown& unknown, std::span<double> to) {
  switch (unknown.kind) {
    case DPDE_UNKNOWN_PARAM: to[0] = workspace_->params().find(unknown.name)->second; return;
    case DPDE_UNKNOWN_CONTROL:
      std::ranges::copy(workspace_->controls().find(unknown.name)->second.values, to.begin());
      return;
    case DPDE_UNKNOWN_NETWORK:
      std::ranges::copy(workspace_->weights().find(unknown.name)->second.values, to.begin());
      return;
    default: break;
  }
  update_formulas();
  if (unknown.kind == DPDE_UNKNOWN_INITIAL)
    return initial(static_cast<std::size_t>(state_index(unknown.name))).copy_out(to);
  for (std::size_t k = 0, size = workspace_->cell_count(); k * size < to.size(); ++k)
    workspace_->field(unknown.name, k).copy_out(to.subspan(k * size, size));
}

void Engine::set_unknowns(Values x) {
  for (const Unknown& unknown : unknowns_) {
    const Values values = unknown.part_of(std::span<const double>(x));
    switch (unknown.kind) {
      case DPDE_UNKNOWN_PARAM: set_param(unknown.name, values[0]); break;
      case DPDE_UNKNOWN_CONTROL: set_control(unknown.name, values); break;
      case DPDE_UNKNOWN_NETWORK: set_weights(unknown.name, values); break;
      case DPDE_UNKNOWN_COEFFICIENT: set_field(unknown.name, values); break;
      default: set_initial(static_cast<std::size_t>(state_index(unknown.name)), values);
    }
  }
}

Bounds Engine::bounds() const {
  const auto is_bounded = [](const Unknown& unknown) {
    return std::isfinite(unknown.low) || std::isfinite(unknown.high);
  };
  if (std::ranges::none_of(unknowns_, is_bounded)) return {};
  const auto count = static_cast<Eigen::Index>(unknown_count_);
  Bounds bounds{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (const Unknown& unknown : unknowns_) {
    const auto offset = static_cast<Eigen::Index>(unknown.offset), size = static_cast<Eigen::Index>(unknown.size);
    bounds.low.segment(offset, size).setConstant(unknown.low);
    bounds.high.segment(offset, size).setConstant(unknown.high);
  }
  return bounds;
}

}  // namespace dpde
