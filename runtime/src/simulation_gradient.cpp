// SPDX-License-Identifier: Apache-2.0
// Losses and gradients of a simulation with a task.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/through_formula.h"
#include "simulation_impl.h"

namespace dpde {

/// Puts the initial state into the rollout of the losses.
void Simulation::Impl::begin_objective(Rollout& rollout) {
  update_formulas();
  require_host_fields(true);
  for (size_t s = 0; s < initial.size(); ++s) {
    Field& to = rollout.initial(rollout.state_index(initial_states[s].name));
    copy_all(layout, to.base(), initial[s].base());
  }
}

double Simulation::Impl::gradient() {
  Rollout& rollout = objective();
  begin_objective(rollout);
  const GradientResult& result = rollout.gradient();
  was_stopped = result.stopped;
  if (was_stopped) return std::numeric_limits<double>::quiet_NaN();
  copy_bars(rollout, false, gradient_values);
  add_through_formulas(rollout, false, scene.initial_adjoint, scene.coefficient_adjoint, gradient_values);
  return result.loss;
}

/// What the last gradient of `rollout` says of the unknowns, or of their rates.
void Simulation::Impl::copy_bars(const Rollout& rollout, bool of_rates, std::span<double> to) const {
  for (const Unknown& unknown : unknowns) {
    const std::string& variable = of_rates ? unknown.rate : unknown.name;
    const std::span<double> values = unknown.part_of(to);
    if (variable.empty()) {
      std::ranges::fill(values, 0.0);  // nothing varies by its rate
    } else if (unknown.is_field()) {
      rollout.copy_field_bar(variable, values);
    } else {
      rollout.copy_param_bar(variable, values);
    }
  }
}

/// The state or coefficient whose rate this is; "" of other names.
std::string_view Simulation::Impl::value_of_rate(std::string_view rate) const {
  for (const InitialState& state : initial_states) {
    if (rate_of(DPDE_LINK_FIELD, state.name) == rate) return state.name;
  }
  for (const auto& [name, field] : host_fields) {
    if (rate_of(DPDE_LINK_FIELD, name) == rate) return name;
  }
  return "";
}

/// A state at the start, or a coefficient.
bool Simulation::Impl::comes_from_formula(std::string_view field) const {
  const auto state = std::ranges::find(initial_states, field, &InitialState::name);
  if (state != initial_states.end()) return !state->is_given && !state->is_unknown && state->start == DPDE_START_SCENE;
  const auto coefficient = host_fields.find(field);
  return coefficient != host_fields.end() && !coefficient->second.is_given && !coefficient->second.is_unknown;
}

/// What unknown parameters do by the formulas of initial states and coefficients, where those are used. Of rates only
/// what comes by rates: Gauss-Newton leaves out the formulas' own second derivatives, too.
void Simulation::Impl::add_through_formulas(const Rollout& rollout, bool of_rates, const dpde_program* initial_program,
                                            const dpde_program* coefficient_program, std::span<double> to) {
  const auto counts = [&](std::string_view name) {
    const std::string_view value = value_of_rate(name);
    return value.empty() ? !of_rates && comes_from_formula(name) : comes_from_formula(value);
  };
  const auto add = [&](std::string_view param, double value) {
    for (const Unknown& unknown : unknowns) {
      if (unknown.kind == DPDE_UNKNOWN_PARAM && (of_rates ? unknown.rate : unknown.name) == param)
        to[unknown.offset] += value;
    }
  };
  const auto add_network = [&](std::string_view network) {
    const auto learned =
        std::ranges::find_if(unknowns, [&](const Unknown& u) { return u.is_network() && u.name == network; });
    if (learned == unknowns.end() || of_rates) return;
    const std::vector<double>& bars = formula_bars.find(network)->second;
    for (size_t i = 0; i < bars.size(); ++i) to[learned->offset + i] += bars[i];
  };
  const auto is_used =
      [&](const dpde_program& program) {  // where all is given nothing was computed that the adjoint could read
        return std::ranges::any_of(links_of(program), [&](const dpde_link& link) {
          return is_seed_of_field(program, link) && counts(link.primal);
        });
      };
  for (const dpde_program* program : {coefficient_program, initial_program}) {
    if (program != nullptr && is_used(*program))
      add_through_formula(*this, *program, rollout, counts, add, add_network);
  }
}

const Unknown& Simulation::Impl::unknown_named(std::string_view name) const {
  const auto found = std::ranges::find(unknowns, name, &Unknown::name);
  if (found != unknowns.end()) return *found;
  const std::string task = scene.task == nullptr ? "a task" : std::string("task ") + scene.task;
  throw Error(ErrorKind::input, fmt::format("{} is not an unknown of {}", name, task));
}

/// Optimisers do not ask for it: to them a step that blows up is one that is too long. Where all states are finite
/// `what` is at fault.
void Simulation::Impl::refuse(Rollout& rollout, const std::string& what) const {
  const std::optional<BlowUp> first = rollout.run().blow_up;
  if (!first)
    throw NotFinite(
        what +
        " is not finite, though all states are: a root or a power may have no derivative at 0, or a quotient no value");
  throw NotFinite(
      fmt::format("{} is no longer finite after step {} of {} (t = {:.6g}) in cell ({}, {}, {}); "
                  "a smaller step than {} may help",
                  rollout.state_name(first->state), first->step, scene.steps, first->t, first->cell.x, first->cell.y,
                  first->cell.z, scene.step));
}

double Simulation::gradient() {
  const double loss = impl_->gradient();
  if (impl_->was_stopped) return loss;
  if (!std::isfinite(loss)) impl_->refuse(impl_->objective(), "the loss");
  for (const Unknown& unknown : impl_->unknowns) {
    const bool is_finite =
        std::ranges::all_of(unknown.part_of(gradient_vector()), [](double value) { return std::isfinite(value); });
    if (!is_finite) impl_->refuse(impl_->objective(), fmt::format("the gradient of the loss by {}", unknown.name));
  }
  return loss;
}

std::span<const double> Simulation::gradient_vector() const { return impl_->gradient_values; }

std::span<const double> Simulation::gradient_of(std::string_view name) const {
  return impl_->unknown_named(name).part_of(gradient_vector());
}

void Simulation::watch_gradients(GradientCallback progress, int every) {
  impl_->watch = std::move(progress);
  impl_->watch_every = every;
  for (std::optional<Rollout>* rollout : {&impl_->losses, &impl_->full, &impl_->gauss_newton}) {
    if (*rollout) (*rollout)->watch_gradient(impl_->watch, every);
  }
}

}  // namespace dpde
