// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/legs.h"

#include <algorithm>

#include "dpde/runtime/layout.h"
#include "run/forward/blocks.h"

namespace dpde {
namespace {

/// Below, the states of a gradient stay in the shared cache: reading them is cheaper than recomputing.
constexpr int64_t least_trajectory = 64 << 20;

}  // namespace

void Legs::plan(bool states_are_stored) {
  if (setup_.block_steps == 1 || has_parts(setup_) || setup_.cut > 0 || !adjoint_.program().fill_states.empty()) return;
  const bool chooses = setup_.block_steps == 0;
  const int64_t state_bytes = field_bytes(setup_.layout) * static_cast<int64_t>(bars_.count());
  if (chooses && !may_pay_in_blocks(*setup_.adjoint, setup_.layout)) return;
  if (chooses && states_are_stored && state_bytes * losses_.last() < least_trajectory) return;
  for (const int steps : chooses ? std::vector{8, 4, 2} : std::vector{setup_.block_steps}) {
    block_ = make_block(steps, chooses);
    if (block_ && plan_marks(steps)) return;
  }
  block_.reset();
}

std::optional<Legs::Block> Legs::make_block(int steps, bool chooses) const {
  const Executor &step = stepper_.program().executor, &adjoint = adjoint_.program().executor;
  AdjointFields fields{adjoint_.program().states, {}};
  for (const FieldBar& bar : adjoint_.bound().fields)
    fields.added.emplace_back(bar.field, static_cast<int>(bar.number));
  std::optional<Wavefront> back = Wavefront::make_reverse(step, adjoint, fields, steps, 1);
  if (!back || (chooses && back->work() > most_extra_work)) return std::nullopt;
  if (setup_.team.threads() > 1) back = Wavefront::make_reverse(step, adjoint, fields, steps, setup_.team);
  std::optional<Wavefront> forward = Wavefront::make(step, steps, setup_.team);
  if (!forward) return std::nullopt;
  const std::span swaps(setup_.adjoint->swaps, static_cast<size_t>(setup_.adjoint->swap_count));
  Block block{std::move(*forward), std::move(*back), {}, {}, {}};
  for (const dpde_swap& swap : swaps) {
    const std::vector<int>& results = adjoint_.bound().results;
    block.results_of.push_back(static_cast<size_t>(std::ranges::find(results, swap.next) - results.begin()));
  }
  block.results.assign(swaps.size(), nullptr);
  block.totals.assign(setup_.sought.size(), nullptr);
  return block;
}

/// Blocks without a loss or the begin of an interval inside, else single steps; returns false if no block fits.
bool Legs::plan_marks(int steps) {
  marks_ = {0};
  for (int n = 0; n < losses_.last(); n = marks_.back()) {
    const int until = std::min(losses_.events().next_after(n), inputs_.end_of_intervals(n));
    marks_.push_back(until - n >= steps ? n + steps : n + 1);
  }
  if (count() < losses_.last()) return true;
  marks_.clear();
  return false;
}

void Legs::run(int leg, const StateBuffer& from, const StateBuffer& to) {
  const int n = mark(leg);
  if (KeptSteps* const kept = adjoint_.kept()) return kept->step(n, from, to);
  if (steps_of(leg) == 1) return stepper_.step(n, from, to);
  stepper_.run_block(block_->step, n, from, to);
}

void Legs::reverse(int leg, const StateBuffer& state) {
  const int n = mark(leg);
  const bool new_seeds = losses_.has(mark(leg + 1));
  if (steps_of(leg) == 1) {
    adjoint_.reverse(n, state, new_seeds);
  } else {
    reverse_block(n, state, new_seeds);
  }
  add_losses(n, state);
}

void Legs::reverse_block(int n, const StateBuffer& state, bool new_seeds) {
  adjoint_.bind(state);
  if (new_seeds) adjoint_.prepare_seeds();
  for (size_t s = 0; s < block_->results.size(); ++s) block_->results[s] = bars_.results()[block_->results_of[s]];
  for (size_t i = 0; i < block_->totals.size(); ++i) block_->totals[i] = static_cast<double*>(sums_.field(i, n));
  Wavefront& block = block_->adjoint;
  block.set_totals(block_->totals);
  stepper_.run_block(block, n, state, block_->results, &adjoint_.program());
  bars_.swap();
  for (size_t p = 0; p < block.passes().size(); ++p) {
    const WavefrontPass& pass = block.passes()[p];
    if (pass.program == 1) sums_.add_params(block.sums(p), adjoint_.bound().params, n + pass.step);
  }
}

/// At a cut, adjoints from later states are dropped before the losses add theirs.
void Legs::add_losses(int n, const StateBuffer& state) {
  if (setup_.cut > 0 && n != 0 && n % setup_.cut == 0) bars_.zero();
  seeds_.add(n, state);
}

}  // namespace dpde
