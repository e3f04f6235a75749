// SPDX-License-Identifier: Apache-2.0
// Steps that keep for their adjoint what it reads of states; see RolloutSetup::keeping_step.
#include <algorithm>

#include "rollout_impl.h"

namespace dpde {

/// The inputs of the adjoint that the step makes and that are no states: fields of the step, and of the adjoint.
std::vector<std::pair<int, int>> Rollout::Impl::kept_by_step() const {
  const dpde_program &step = *setup.keeping_step, &adjoint = *setup.kept_adjoint;
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

void Rollout::Impl::take_kept_adjoint() {
  const dpde_program& step = *setup.keeping_step;
  std::vector<std::pair<int, int>> fields = kept_by_step();
  std::vector<std::string> kept, own;
  for (const auto& [field, input] : fields) kept.emplace_back(step.fields[field]);
  std::vector<int> next;
  own = kept;
  for (const dpde_swap& swap : std::span(step.swaps, static_cast<size_t>(step.swap_count))) {
    next.push_back(swap.next);
    own.emplace_back(step.fields[swap.next]);
  }
  keeping.emplace(BoundKeeping{{bind_program(step, own, true), std::move(next)}, std::move(fields), {}});
  bytes_of_fields -= backward->bytes;
  backward.reset();
  bind_adjoint(*setup.kept_adjoint, std::move(kept));
}

/// Whether what the step may keep takes the place of as many of the states that are stored, within the budget: of
/// states that are not, three are worked in.
bool Rollout::Impl::keeps_less_than(const std::vector<char>& read) const {
  if (setup.keeping_step == nullptr || setup.kept_adjoint == nullptr || !marks.empty() || has_parts() ||
      setup.ranks != nullptr || !setup.checkpoint_folder.empty())
    return false;
  const auto kept = static_cast<int64_t>(kept_by_step().size());
  const int64_t all = std::ranges::count(read, char{1}),
                others = std::ranges::count(states_read(*setup.kept_adjoint), 1);
  const int64_t buffers = std::max<int64_t>(last_loss, 3), states = std::ssize(read);
  const int64_t fields = kept * last_loss + others * buffers + 3 * (states - others) + states;
  return kept + others <= all && fields * FieldPool::stride_of(setup.layout) <= setup.checkpoint_bytes;
}

void Rollout::Impl::bind_kept(int n) {
  for (size_t i = 0; keeping && i < keeping->fields.size(); ++i)
    backward->program.executor.bind(keeping->fields[i].second, keeping->at(n, i));
}

/// Step n, as gradients make it where something is kept.
void Rollout::Impl::keeping_step(int n, const StateBuffer& from, const StateBuffer& to) {
  BoundProgram& program = keeping->step.program;
  bind_buffers(keeping->step, from, to);
  for (size_t i = 0; i < keeping->fields.size(); ++i)
    program.executor.bind(keeping->fields[i].first, keeping->at(n, i));
  set_step(program, n);
  run_in_step(program.executor, n);
}

}  // namespace dpde
