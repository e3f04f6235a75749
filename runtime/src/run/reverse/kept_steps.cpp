// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/kept_steps.h"

#include <algorithm>
#include <span>

namespace dpde {

std::vector<std::pair<int, int>> kept_fields(const ResolvedSetup& setup, const dpde_adjoint_variant& variant) {
  const dpde_program &step = *variant.step, &adjoint = *variant.adjoint;
  const std::span swaps(step.swaps, static_cast<size_t>(step.swap_count));
  std::vector<std::pair<int, int>> kept;
  for (int field = step.input_count; field < step.field_count; ++field) {
    const int input = setup.ids(adjoint).field(setup.ids(step).fields[static_cast<size_t>(field)]);
    const bool is_next = std::ranges::find(swaps, field, &dpde_swap::next) != swaps.end();
    if (input >= 0 && input < adjoint.input_count && !is_next) kept.emplace_back(field, input);
  }
  return kept;
}

KeptSteps::KeptSteps(const ResolvedSetup& setup, const dpde_adjoint_variant& variant, const StepInputs& inputs,
                     int steps, Binder& binder)
    : setup_(setup),
      inputs_(inputs),
      steps_(steps),
      program_(*variant.step),
      kept_(kept_fields(setup, variant)),
      step_(binder.bind_step(program_, ids_of(kept_))) {}

std::vector<ValueId> KeptSteps::ids_of(const std::vector<std::pair<int, int>>& kept) const {
  std::vector<ValueId> ids;
  for (const auto& [field, input] : kept) ids.push_back(setup_.ids(program_).fields[static_cast<size_t>(field)]);
  return ids;
}

void KeptSteps::step(int n, const StateBuffer& from, const StateBuffer& to) {
  step_.bind(from, to);
  for (size_t i = 0; i < kept_.size(); ++i) step_.program.executor.bind(kept_[i].first, at(n, i));
  inputs_.set(step_.program, n);
  inputs_.run_in_step(step_.program.executor, n);
}

void KeptSteps::bind(Executor& adjoint, int n) const {
  for (size_t i = 0; i < kept_.size(); ++i) adjoint.bind(kept_[i].second, at(n, i));
}

}  // namespace dpde
