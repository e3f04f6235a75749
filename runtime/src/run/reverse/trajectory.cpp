// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/trajectory.h"

#include <algorithm>
#include <limits>
#include <span>

#include "dpde/runtime/communicator.h"

namespace dpde {

/// Which states the reverse pass reads, apart from those of the last step, with this adjoint of a step.
std::vector<char> Trajectory::states_read(const dpde_program& adjoint, const BoundProgram* rate) const {
  std::vector<char> read(states_.now.size(), 0);
  for (size_t s = 0; s < read.size(); ++s) read[s] = setup_.ids(adjoint).field(states_.now[s]) >= 0 ? 1 : 0;
  const auto note = [&](const BoundProgram& program) {
    for (size_t s = 0; s < read.size(); ++s) read[s] = read[s] != 0 || program.states[s] >= 0;
  };
  if (rate != nullptr) note(*rate);
  for (const LossEvent& event : losses_.events().all()) {
    const std::optional<BoundLossAdjoint>& of_loss = losses_.terms()[event.term].adjoint;
    if (event.step < losses_.last() && of_loss) note(of_loss->program);
  }
  return read;
}

/// Steps recomputed by the plan and inside blocks.
int64_t Trajectory::count_recomputed(const Legs& legs) const {
  const int last = losses_.last();
  if (last == 0) return 0;
  if (legs.block_steps() == 1)  // closed form if legs are single steps
    return 1 + checkpoint::advanced_steps(last, slots_) - last;
  int64_t made = legs.steps_of(legs.count() - 1);  // steps of the last leg, for the losses at its end
  checkpoint::Schedule schedule(legs.count(), slots_);
  while (const std::optional<checkpoint::Action> action = schedule.next()) {
    if (action->kind == checkpoint::ActionKind::advance) made += legs.mark(action->to) - legs.mark(action->from);
  }
  return made - last + (last - legs.count());
}

/// Buffers for `slots` stored states, the initial one included, and two work buffers. If all states are stored no step
/// is recomputed: three buffers suffice for states that the adjoints do not read.
void Trajectory::plan_buffers(int slots, const std::vector<char>& read, const Legs* legs) {
  buffers_.count = std::max(slots + 1, 3);
  buffers_.of_state.assign(states_.now.size(), buffers_.count);
  if (!is_stored_ || slots < losses_.last() - 1 || has_parts(setup_) || legs->block_steps() > 1) return;
  for (size_t s = 0; s < read.size(); ++s) {
    if (read[s] == 0) buffers_.of_state[s] = 3;
  }
}

/// Including the seeds, which need one more buffer.
int64_t Trajectory::bytes_of_states(int64_t kept_fields) const {
  return (buffers_.fields() + count() + kept_fields) * FieldPool::stride_of(setup_.layout);
}

/// Number of stored states: setup.slots if given, else as many as fit.
int Trajectory::plan_slots(const std::vector<char>& read, const Legs& legs) {
  const int all = std::max(legs.count() - 1, 1);
  if (setup_.slots > 0) return std::min(setup_.slots, all);
  plan_buffers(all, read, &legs);
  if (bytes_of_states(0) <= setup_.checkpoint_bytes) return all;
  return checkpoint::slots_for(setup_.checkpoint_bytes, count() * FieldPool::stride_of(setup_.layout), legs.count());
}

/// Subgrids differ in size, but all ranks must recompute the same steps.
int Trajectory::least_of_ranks(int64_t slots) const {
  return static_cast<int>(-largest_of(setup_.ranks, -static_cast<double>(slots)));
}

/// Whether storing intermediate fields replaces at least as many stored states, within the budget. States that are not
/// stored need three work buffers.
bool Trajectory::stores_less(const dpde_adjoint_variant& variant, const std::vector<char>& read,
                             const BoundProgram* rate, const Legs& legs) const {
  if (legs.block_steps() > 1 || has_parts(setup_) || setup_.ranks != nullptr || !setup_.checkpoint_folder.empty())
    return false;
  const int last = losses_.last();
  const std::vector<char> still_read = states_read(*variant.adjoint, rate);
  const int64_t kept = std::ssize(kept_fields(setup_, variant)), all = std::ranges::count(read, char{1}),
                others = std::ranges::count(still_read, char{1});
  const int64_t buffers = std::max<int64_t>(last, 3);
  const int64_t fields = kept * last + others * buffers + 3 * (count() - others) + count();
  return kept + others <= all && fields * FieldPool::stride_of(setup_.layout) <= setup_.checkpoint_bytes;
}

void Trajectory::plan_tapes(Executor& step, Executor& adjoint, Losses& losses, int64_t left, bool is_plan) {
  if (!setup_.checkpoint_folder.empty()) return;          // the budget is for a file
  if (setup_.trial != nullptr || setup_.follows) return;  // the number of runs is not known
  std::vector<ProgramPair> pairs{{step, adjoint, losses.last()}};
  for (size_t i = 0; i < losses.terms().size(); ++i) {
    BoundTerm& term = losses.terms()[i];
    if (!term.adjoint) continue;
    pairs.push_back(
        {term.loss.program.executor, term.adjoint->program.executor, std::ssize(setup_.losses[i].at_steps)});
  }
  const double most_share = setup_.slots > 0 ? static_cast<double>(setup_.slots) / std::max(losses.last(), 1) : 1.0;
  tapes_.plan(setup_, pairs, left, most_share, is_plan);
}

/// Chooses the legs and the adjoint of steps that store least.
void Trajectory::plan_way_back(const BoundProgram* rate, WayBack& back, std::vector<char>& read, Binder& binder,
                               RunMemory& memory) {
  read = states_read(*setup_.adjoint, rate);
  is_stored_ = std::ranges::find(read, char{1}) != read.end();
  back.legs.plan(is_stored_);
  // Blocks of steps add rows to sums while these are in the first-level cache.
  const dpde_adjoint_variant* accumulating = setup_.find_variant(false);
  if (accumulating != nullptr && back.legs.block_steps() == 1)
    back.adjoint.replace(*accumulating->adjoint, binder, memory);
  if (!is_stored_) return;
  slots_ = least_of_ranks(plan_slots(read, back.legs));
  const dpde_adjoint_variant* storing = setup_.find_variant(true);
  if (storing != nullptr && slots_ >= losses_.last() - 1 && stores_less(*storing, read, rate, back.legs)) {
    read = states_read(*storing->adjoint, rate);
    back.adjoint.replace_by_kept(*storing, losses_.last(), binder, memory);
  }
  if (!memory.is_plan()) reversal_ = Reversal(back.legs.count(), slots_);
  recomputed_ = count_recomputed(back.legs);
}

void Trajectory::plan(Stepper& stepper, Losses& losses, WayBack* back, Binder& binder, RunMemory& memory) {
  std::vector<char> read;
  const bool goes_back = back != nullptr && setup_.steady == 0;
  if (goes_back) plan_way_back(stepper.rate_program(), *back, read, binder, memory);
  plan_buffers(slots_, read, goes_back ? &back->legs : nullptr);
  KeptSteps* const kept = back != nullptr ? back->adjoint.kept() : nullptr;
  buffers_.over = kept != nullptr ? kept->may_be_over() : stepper.may_be_over();
  if (back == nullptr) return;
  bytes_ = bytes_of_states(back->adjoint.kept_fields());
  // The budget left by states between steps is for tapes and for states between substeps, which need two more work
  // buffers.
  const int64_t unused = std::max<int64_t>(setup_.checkpoint_bytes - bytes_, 0);
  if (goes_back)
    plan_tapes(stepper.program().executor, back->adjoint.program().executor, losses,
               has_parts(setup_) ? unused / 2 : unused, memory.is_plan());
  const int64_t left = (unused - tapes_.bytes()) / (count() * FieldPool::stride_of(setup_.layout)) - 2;
  const int64_t slots = std::clamp<int64_t>(left, 1, std::numeric_limits<int>::max() - 1);
  back->adjoint.set_part_slots(setup_.slots > 0 ? setup_.slots : least_of_ranks(slots));
}

}  // namespace dpde
