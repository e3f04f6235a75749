// SPDX-License-Identifier: Apache-2.0
// Losses of averages, L = F(a_1, ..., a_m, p) with a_j = sum over states of s_j(x_k): the run adds up the averages,
// then F is computed once, and its derivatives are what the adjoint of each s_j is weighed with on the way back:
//
//   dL/dx_k = sum_j dF/da_j * ds_j/dx_k
//
// So a gradient takes no more runs than that of any other loss.
#include <algorithm>

#include "rollout_impl.h"

namespace dpde {

/// Its number; new where it is not known yet.
int Rollout::Impl::average_called(const std::string& name) {
  const auto found = std::ranges::find(averages, name, &Average::name);
  if (found != averages.end()) return static_cast<int>(found - averages.begin());
  averages.push_back({name});
  return static_cast<int>(averages.size()) - 1;
}

void Rollout::Impl::begin_averages() {
  for (Average& average : averages) average.value = average.bar = 0;
}

void Rollout::Impl::give_averages(BoundProgram& program) {
  for (const Average& average : averages) {
    const int param = program.executor.param_index(average.name);
    if (param >= 0) program.executor.set_param(param, average.value);
  }
  set_step(program, last_loss);
  program.prepare_inputs();
}

void Rollout::Impl::add_losses_of_averages() {
  for (BoundTerm& term : terms) {
    if (!term.of_averages) continue;
    BoundProgram& program = term.loss.program;
    give_averages(program);
    run_at_state(program.executor, last_loss);
    loss_value += term.weight * program.executor.sums()[static_cast<size_t>(term.loss.sum)];
  }
}

/// `take` gets what the adjoint of each loss of averages has found.
void Rollout::Impl::derive_averages(
    const std::function<void(std::span<const double> sums, const BoundLossAdjoint&)>& take) {
  for (BoundTerm& term : terms) {
    if (!term.of_averages || !term.adjoint) continue;
    BoundProgram& program = term.adjoint->program;
    give_averages(program);
    run_at_state(program.executor, last_loss);
    take(program.executor.sums(), *term.adjoint);
  }
}

/// Before the way back: what depends on parameters alone goes to the gradient at once.
void Rollout::Impl::seed_averages() {
  derive_averages([&](std::span<const double> sums, const BoundLossAdjoint& adjoint) {
    add_param_bars(sums, adjoint.params, last_loss);
    for (Average& average : averages) {
      for (const ParamBar& param : adjoint.params) {
        if (param_bar_names[param.param] == average.name) average.bar += sums[param.sum];
      }
    }
  });
  for (BoundTerm& term : terms) {
    if (term.average < 0 || !term.adjoint || term.seed < 0) continue;
    const double bar = averages[static_cast<size_t>(term.average)].bar;
    term.adjoint->program.executor.set_param(term.seed, term.weight * bar);
  }
}

std::vector<std::pair<std::string, double>> Rollout::derivatives_of_averages() {
  std::vector<std::pair<std::string, double>> all;
  impl_->derive_averages([&](std::span<const double> sums, const BoundLossAdjoint& adjoint) {
    for (const ParamBar& param : adjoint.params) all.emplace_back(impl_->param_bar_names[param.param], sums[param.sum]);
  });
  return all;
}

void Rollout::set_weight(std::size_t term, double weight) { impl_->terms[term].weight = weight; }

}  // namespace dpde
