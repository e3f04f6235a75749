// SPDX-License-Identifier: Apache-2.0
// Several steps in one pass over memory, forward and backward: when, how many, and how blocks are run. A block of the
// gradient begins at a stored state and ends where the next one is; losses count at its ends only, and control fields
// stay the same in it. The plan depends on the grid and the losses, not on memory or threads, and so do the sums of the
// adjoints.
#include <algorithm>

#include "rollout_impl.h"

namespace dpde {
namespace {

constexpr int64_t least_bytes_for_blocks = 2 << 20;
/// Below that the states of a gradient stay in the shared cache, and reading them is cheaper than making them again.
constexpr int64_t least_trajectory = 64 << 20;
constexpr double most_extra_work = 1.2;

/// In 3-D planes of the rings are read from the shared cache, and stencils that read several planes on each side are
/// faster in tuned plain sweeps (Zen 5, 192^3: 25 points 1.35 times, 13 points 1.2 times).
bool reads_far_planes(const dpde_program& program) { return program.rank == 3 && program.halo[2] > 1; }

}  // namespace

/// Blocks where a plain sweep would leave the core's own cache: as many steps as do not compute too much twice.
void Rollout::Impl::plan_block() {
  const Executor& executor = forward->program.executor;
  if (setup.block_steps == 1 || has_parts()) return;
  if (setup.block_steps > 1) {
    forward->block = Wavefront::make(executor, setup.block_steps, setup.team);
    return;
  }
  if (field_bytes(setup.layout) * setup.step->field_count < least_bytes_for_blocks || reads_far_planes(*setup.step))
    return;
  int longest = setup.steps;
  for (const ControlField& control : setup.control_fields) longest = std::min(longest, control.every);
  for (const int steps : {16, 8, 4, 2}) {
    if (steps > longest) continue;
    forward->block = Wavefront::make(executor, steps, setup.team);
    if (forward->block && forward->block->work() <= most_extra_work) return;
  }
  forward->block.reset();
}

/// The adjoints of several steps at once where that saves storing their states.
void Rollout::Impl::plan_reverse_block() {
  if (setup.block_steps == 1 || has_parts() || setup.cut > 0 || !backward->program.fill_states.empty()) return;
  AdjointFields fields{backward->program.states, {}};
  for (const FieldBar& bar_of_field : backward->fields)
    fields.added.emplace_back(bar_of_field.field, static_cast<int>(bar_of_field.number));
  const bool chooses = setup.block_steps == 0;
  const int64_t bytes = field_bytes(setup.layout), states = static_cast<int64_t>(state_names.size());
  if (chooses && (bytes * setup.adjoint->field_count < least_bytes_for_blocks || reads_far_planes(*setup.adjoint)))
    return;
  if (chooses && keeps_trajectory && bytes * states * last_loss < least_trajectory) return;
  const Executor &step = forward->program.executor, &adjoint = backward->program.executor;
  for (const int steps : chooses ? std::vector{8, 4, 2} : std::vector{setup.block_steps}) {
    backward->block = Wavefront::make_reverse(step, adjoint, fields, steps, 1);
    if (!backward->block || (chooses && backward->block->work() > most_extra_work)) continue;
    if (setup.team.threads() > 1) backward->block = Wavefront::make_reverse(step, adjoint, fields, steps, setup.team);
    forward->leg = Wavefront::make(step, steps, setup.team);
    if (forward->leg && plan_marks()) return;
  }
  backward->block.reset();
  forward->leg.reset();
}

/// Blocks where no loss and no begin of an interval lies inside, else single steps; false where there is no room for a
/// block.
bool Rollout::Impl::plan_marks() {
  const int steps = backward->block->steps();
  marks = {0};
  for (int n = 0; n < last_loss; n = marks.back()) {
    const int until = std::min(std::ranges::upper_bound(events, n, {}, &LossEvent::step)->step, end_of_intervals(n));
    marks.push_back(until - n >= steps ? n + steps : n + 1);
  }
  if (legs() == last_loss) {
    marks.clear();
    return false;
  }
  const std::span swaps(setup.adjoint->swaps, static_cast<size_t>(setup.adjoint->swap_count));
  for (const dpde_swap& swap : swaps) {
    backward->block_results.push_back(
        static_cast<size_t>(std::ranges::find(backward->results, swap.next) - backward->results.begin()));
  }
  leg_results.assign(swaps.size(), nullptr);
  leg_totals.assign(sought.size(), nullptr);
  return true;
}

/// Steps n, n + 1, ... or their adjoints, from the states before the first one.
void Rollout::Impl::run_block(Wavefront& block, int n, const StateBuffer& from, std::span<void* const> results) {
  const bool is_adjoint = backward && backward->block && &block == &*backward->block;
  const Stopwatch watch_of_block(setup.seconds == nullptr ? nullptr
                                 : is_adjoint             ? &setup.seconds->adjoints.all
                                                          : &setup.seconds->steps.all);
  for (size_t p = 0; p < block.passes().size(); ++p) {
    const WavefrontPass& pass = block.passes()[p];
    BoundProgram& program = pass.program == 0 ? forward->program : backward->program;
    set_step(program, n + pass.step);
    block.set_uniforms(p, program.executor.uniforms());
  }
  forward->program.bind_states(from);
  block.run(results);
}

void Rollout::Impl::run_leg(int leg, const StateBuffer& from, const StateBuffer& to) {
  const int n = mark(leg);
  if (keeping) return keeping_step(n, from, to);
  if (mark(leg + 1) - n == 1) return step(n, from, to);
  run_block(*forward->leg, n, from, to);
}

/// The adjoints of the steps of a leg, and the losses at its first state, which is `state`.
void Rollout::Impl::reverse_leg(int leg, const StateBuffer& state) {
  const int n = mark(leg), end = mark(leg + 1);
  if (end - n == 1) return reverse(n, state);
  bind_reverse(state, bar);
  if (has_losses(end)) prepare_seeds();
  for (size_t s = 0; s < leg_results.size(); ++s) leg_results[s] = bars[1 - bar][backward->block_results[s]];
  for (size_t i = 0; i < sought.size(); ++i)
    leg_totals[i] = static_cast<double*>(field_bar_pool.base(static_cast<int64_t>(sought[i].at(n))));
  Wavefront& block = *backward->block;
  block.set_totals(leg_totals);
  run_block(block, n, state, leg_results);
  bar = 1 - bar;
  for (size_t p = 0; p < block.passes().size(); ++p) {
    if (block.passes()[p].program == 1) add_param_bars(block.sums(p), backward->params, n + block.passes()[p].step);
  }
  if (has_losses(n)) add_seeds(n, state);
}

}  // namespace dpde
