// SPDX-License-Identifier: Apache-2.0
// Losses and gradients of a simulation with a task.
#include <algorithm>
#include <limits>

#include "simulation_impl.h"

namespace dpde {

/// Puts the initial state into the rollout of the losses.
void Simulation::Impl::begin_objective() {
  update_formulas();
  require_host_fields(true);
  for (size_t s = 0; s < initial.size(); ++s) {
    Field& to = losses->initial(static_cast<int>(s));
    copy_all(layout, to.base(), initial[s].base());
  }
}

double Simulation::Impl::gradient() {
  Rollout& rollout = objective();
  begin_objective();
  const GradientResult& result = rollout.gradient();
  if (result.stopped) return std::numeric_limits<double>::quiet_NaN();
  for (UnknownGradient& unknown : unknowns) {
    const auto index = static_cast<size_t>(unknown.index);
    switch (unknown.kind) {
      case DPDE_UNKNOWN_INITIAL: copy_out(result.state_bars[index], unknown.values); break;
      case DPDE_UNKNOWN_COEFFICIENT: copy_out(result.field_bars[index], unknown.values); break;
      case DPDE_UNKNOWN_CONTROL:
        if (unknown.index >= 0) unknown.values = result.control_bars[index];
        break;
      default: unknown.values[0] = unknown.index < 0 ? 0.0 : result.param_bars[index];
    }
  }
  if (scene.initial_adjoint != nullptr) add_gradient_through_initial(result);
  if (scene.coefficient_adjoint != nullptr) add_gradient_through_coefficients(result);
  return result.loss;
}

/// What unknown parameters do by the formulas of the initial states, where those are used.
void Simulation::Impl::add_gradient_through_initial(const GradientResult& result) {
  for (size_t s = 0; s < initial_states.size(); ++s) {
    Field& seed = field(initial_states[s].name + "_bar");
    const InitialState& state = initial_states[s];
    seed.fill(0);
    if (state.is_given || state.is_unknown || state.start != DPDE_START_SCENE) continue;
    copy_interior(layout, seed.base(), result.state_bars[s]);
  }
  run_single(run_initial_adjoint, *scene.initial_adjoint, scene.t_begin);
  add_sums(run_initial_adjoint->executor);
}

/// The same for coefficients.
void Simulation::Impl::add_gradient_through_coefficients(const GradientResult& result) {
  for (int32_t c = 0; c < scene.coefficient_count; ++c) field(std::string(scene.coefficients[c].name) + "_bar").fill(0);
  for (int32_t c = 0; c < scene.sought_count; ++c) {
    const HostField& coefficient = host_field_named(scene.sought[c]);
    if (coefficient.is_given || coefficient.is_unknown) continue;
    Field& seed = field(std::string(scene.sought[c]) + "_bar");
    copy_interior(layout, seed.base(), result.field_bars[static_cast<size_t>(c)]);
  }
  run_single(run_coefficient_adjoint, *scene.coefficient_adjoint, scene.t_begin);
  add_sums(run_coefficient_adjoint->executor);
}

void Simulation::Impl::add_sums(const Executor& adjoint) {
  for (UnknownGradient& unknown : unknowns) {
    if (unknown.kind != DPDE_UNKNOWN_PARAM) continue;
    const int sum = adjoint.sum_index(unknown.name + "_bar");
    if (sum >= 0) unknown.values[0] += adjoint.sums()[static_cast<size_t>(sum)];
  }
}

}  // namespace dpde
