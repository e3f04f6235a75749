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
    std::copy_n(initial[s].base() - layout.origin, layout.size, to.base() - layout.origin);
  }
}

double Simulation::Impl::gradient() {
  Rollout& rollout = objective();
  begin_objective();
  const GradientResult& result = rollout.gradient();
  if (result.stopped) return std::numeric_limits<double>::quiet_NaN();
  for (UnknownGradient& unknown : unknowns) {
    if (unknown.is_initial) {
      copy_out(layout, result.state_bars[static_cast<size_t>(unknown.index)], unknown.values);
    } else {
      unknown.values[0] = unknown.index < 0 ? 0.0 : result.param_bars[static_cast<size_t>(unknown.index)];
    }
  }
  if (scene.initial_adjoint != nullptr) add_gradient_through_initial(result);
  return result.loss;
}

/// What unknown parameters do by the formulas of the initial states, where those are used.
void Simulation::Impl::add_gradient_through_initial(const GradientResult& result) {
  const dpde_program& program = *scene.initial_adjoint;
  for (size_t s = 0; s < initial_states.size(); ++s) {
    Field& seed = field(initial_states[s].name + "_bar");
    const InitialState& state = initial_states[s];
    seed.fill(0);
    if (state.is_given || state.is_unknown || state.start != DPDE_START_SCENE) continue;
    std::copy_n(result.state_bars[s] - layout.origin, layout.size, seed.base() - layout.origin);
  }
  run_single(run_initial_adjoint, program, scene.t_begin);
  for (UnknownGradient& unknown : unknowns) {
    if (unknown.is_initial) continue;
    const int sum = run_initial_adjoint->executor.sum_index(unknown.name + "_bar");
    if (sum >= 0) unknown.values[0] += run_initial_adjoint->executor.sums()[static_cast<size_t>(sum)];
  }
}

}  // namespace dpde
