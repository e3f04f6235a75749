// SPDX-License-Identifier: Apache-2.0
#include "run/kept_steps.h"

#include <algorithm>
#include <span>
#include <string_view>

namespace dpde {
namespace {

std::vector<std::string> names_of(const std::vector<std::pair<int, int>>& kept, const dpde_program& step) {
  std::vector<std::string> names;
  for (const auto& [field, input] : kept) names.emplace_back(step.fields[field]);
  return names;
}

}  // namespace

std::vector<std::pair<int, int>> kept_fields(const dpde_program& step, const dpde_program& adjoint) {
  const std::span swaps(step.swaps, static_cast<size_t>(step.swap_count));
  const std::span inputs(adjoint.fields, static_cast<size_t>(adjoint.input_count));
  std::vector<std::pair<int, int>> kept;
  for (int field = step.input_count; field < step.field_count; ++field) {
    const auto input = std::ranges::find(inputs, std::string_view(step.fields[field]));
    const bool is_next = std::ranges::find(swaps, field, &dpde_swap::next) != swaps.end();
    if (input != inputs.end() && !is_next) kept.emplace_back(field, static_cast<int>(input - inputs.begin()));
  }
  return kept;
}

KeptSteps::KeptSteps(const RolloutSetup& setup, const StepInputs& inputs, int steps, Binder& binder)
    : setup_(setup),
      inputs_(inputs),
      steps_(steps),
      kept_(kept_fields(*setup.keeping_step, *setup.kept_adjoint)),
      step_(binder.bind_step(*setup.keeping_step, names_of(kept_, *setup.keeping_step))) {}

std::vector<std::string> KeptSteps::names() const { return names_of(kept_, *setup_.keeping_step); }

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
