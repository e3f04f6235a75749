// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/step_adjoint.h"

#include <algorithm>

namespace dpde {
namespace {

constexpr int most_single_steps = 16;

}  // namespace

void SingleTotals::allocate(const dpde_layout& layout, const std::vector<FieldBar>& totals, RunMemory& memory) {
  if (layout.real != DPDE_F32 || totals.empty()) return;
  layout_ = &layout;
  count_ = std::ssize(totals);
  pool_ = memory.pool(layout, count_);
}

void SingleTotals::begin() {
  for (int64_t i = 0; i < count_; ++i) fill_all(*layout_, pool_.base(i), 0.0);
  steps_ = 0;
}

void SingleTotals::flush(const BoundAdjoint& adjoint, GradientSums& sums, int n) {
  const bool ends = std::ranges::any_of(
      adjoint.totals, [&](const FieldBar& total) { return n == 0 || !sums.continues(total.number, n); });
  if (++steps_ < most_single_steps && !ends) return;
  sums.add_fields(adjoint.program.executor, adjoint.totals, n);
  for (const FieldBar& total : adjoint.totals) fill_all(*layout_, adjoint.program.executor.bound(total.field), 0.0);
  steps_ = 0;
}

StepAdjoint::StepAdjoint(const ResolvedSetup& setup, const StepInputs& inputs, Stepper& stepper, GradientSums& sums,
                         AdjointStates& bars, Binder& binder)
    : setup_(setup),
      inputs_(inputs),
      stepper_(stepper),
      sums_(sums),
      bars_(bars),
      bound_(binder.bind_adjoint(*setup.adjoint)) {}

void StepAdjoint::replace(const dpde_program& program, Binder& binder, RunMemory& memory) {
  memory.give_back(bound_->program.executor.program(), bound_->bytes);
  bound_.reset();
  bound_.emplace(binder.bind_adjoint(program, kept_ ? kept_->ids() : std::vector<ValueId>()));
}

void StepAdjoint::replace_by_kept(const dpde_adjoint_variant& variant, int steps, Binder& binder, RunMemory& memory) {
  kept_.emplace(setup_, variant, inputs_, steps, binder);
  replace(*variant.adjoint, binder, memory);
}

void StepAdjoint::allocate(RunMemory& memory) {
  if (kept_) kept_->allocate(memory);
  singles_.allocate(setup_.layout, bound_->totals, memory);
}

void StepAdjoint::begin(int last) {
  inputs_.set(bound_->program, last);
  bound_->program.prepare_inputs();
  singles_.begin();
}

void StepAdjoint::bind_totals(int n) {
  for (size_t i = 0; i < bound_->totals.size(); ++i) {
    const FieldBar& total = bound_->totals[i];
    bound_->program.executor.bind(total.field, singles_.is_used() ? singles_.base(i) : sums_.field(total.number, n));
  }
}

void StepAdjoint::bind(const StateBuffer& state, bool is_exchanged) {
  const StateBuffer &seeds = is_exchanged ? bars_.results() : bars_.seeds(),
                    &results = is_exchanged ? bars_.seeds() : bars_.results();
  bound_->program.bind_states(state);
  for (size_t i = 0; i < state.size(); ++i) {
    bound_->program.executor.bind(bound_->seeds[i], seeds[i]);
    bound_->program.executor.bind(bound_->results[i], results[i]);
  }
}

void StepAdjoint::reverse(int n, const StateBuffer& state, bool new_seeds) {
  const int parts = stepper_.parts_of(n, state);
  if (parts > 1 && bound_->program.reads_states()) return reverse_parts(n, parts, state, new_seeds);
  for (int part = parts; part-- > 0;)
    reverse_part(n, stepper_.part_at(n, part, parts), state, new_seeds && part + 1 == parts);
}

/// Recomputes the states between the substeps of a step, by a separate checkpoint plan.
void StepAdjoint::reverse_parts(int n, int parts, const StateBuffer& state, bool new_seeds) {
  if (planned_parts_ != parts) {
    part_reversal_ = Reversal(parts, std::min(parts, part_slots_));
    planned_parts_ = parts;
  }
  const auto buffer = [this](int i) -> const StateBuffer& { return stepper_.part_states()[i]; };
  const auto advance = [&](int part, const StateBuffer& from, const StateBuffer& to) {
    stepper_.part_of_step(n, stepper_.part_at(n, part, parts), from, to);
    return true;
  };
  const auto reverse = [&](int part, const StateBuffer& at) {
    reverse_part(n, stepper_.part_at(n, part, parts), at, new_seeds && part + 1 == parts);
    return true;
  };
  part_reversal_.run(state, buffer, advance, reverse);
}

void StepAdjoint::reverse_part(int n, const PartOfStep& part, const StateBuffer& state, bool new_seeds) {
  inputs_.set(bound_->program, n, part);
  if (kept_) kept_->bind(bound_->program.executor, n);
  bind_totals(n);
  bind(state);
  if (new_seeds) prepare_seeds();
  inputs_.run_in_step(bound_->program.executor, n, part.begin);
  take(n);
}

void StepAdjoint::prepare_seeds() {
  for (int seed : bound_->seeds) bound_->program.executor.prepare(seed);
}

void StepAdjoint::take(int n) {
  bars_.swap();
  if (!adds_) return;
  sums_.add_params(bound_->program.executor.sums(), bound_->params, n);
  sums_.add_fields(bound_->program.executor, bound_->fields, n);
  if (singles_.is_used()) singles_.flush(*bound_, sums_, n);
}

void StepAdjoint::add_to_gradient(bool adds) {
  adds_ = adds;
  sums_.bind_weights(bound_->program.executor, adds);
}

}  // namespace dpde
