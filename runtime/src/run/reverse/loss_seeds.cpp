// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/loss_seeds.h"

#include <algorithm>

namespace dpde {

void LossSeeds::set(int k, const StateBuffer& state) {
  std::ranges::fill(is_seeded_, char{0});
  seed_averages();
  for (const LossEvent& event : losses_.at(losses_.last())) run(event, k, state);
  for (size_t i = 0; i < is_seeded_.size(); ++i) {
    if (is_seeded_[i]) continue;
    bars_.zero(i);
    is_seeded_[i] = 1;
  }
}

void LossSeeds::add(int k, const StateBuffer& state) {
  for (const LossEvent& event : losses_.at(k)) run(event, k, state);
}

/// Contributions of parameters alone are added to the gradient here.
void LossSeeds::seed_averages() {
  losses_.derive_averages([&](std::span<const double> sums, const BoundLossAdjoint& adjoint) {
    sums_.add_params(sums, adjoint.params, losses_.last());
    for (const ParamBar& param : adjoint.params) losses_.add_to_average(sums_.param_id(param.param), sums[param.sum]);
  });
  losses_.weigh_averages();
}

/// At the last state the first loss writes the seeds, others add to them.
void LossSeeds::run(const LossEvent& event, int k, const StateBuffer& state) {
  if (!losses_.terms()[event.term].adjoint) return;
  BoundLossAdjoint& adjoint = *losses_.terms()[event.term].adjoint;
  BoundProgram& program = adjoint.program;
  for (const BoundData& data : adjoint.data) program.executor.bind(data.field, data.at[event.entry]);
  for (size_t i = 0; i < is_seeded_.size(); ++i) {
    if (adjoint.results[i] < 0) continue;
    program.executor.bind(adjoint.results[i], is_seeded_[i] ? bars_.spare()[i] : bars_.seeds()[i]);
  }
  inputs_.set(program, k);
  program.bind_states(state);
  program.prepare_inputs();
  inputs_.run_at_state(program.executor, k);
  for (size_t i = 0; i < is_seeded_.size(); ++i) {
    if (adjoint.results[i] < 0) continue;
    if (is_seeded_[i]) bars_.add_spare(i);
    is_seeded_[i] = 1;
  }
  sums_.add_params(program.executor.sums(), adjoint.params, k);
  sums_.add_fields(program.executor, adjoint.fields, k);
}

}  // namespace dpde
