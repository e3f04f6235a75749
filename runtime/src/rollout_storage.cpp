// SPDX-License-Identifier: Apache-2.0
// Memory of a rollout: how many states a gradient stores, and the buffers of all of them.
#include <algorithm>
#include <limits>
#include <numeric>

#include "dpde/runtime/allocation.h"
#include "rollout_impl.h"

namespace dpde {

/// Which states the reverse pass reads of any step but the last, with this adjoint of a step.
std::vector<char> Rollout::Impl::states_read(const dpde_program& adjoint) const {
  std::vector<char> read(state_names.size(), 0);
  const std::span fields(adjoint.fields, static_cast<size_t>(adjoint.field_count));
  for (size_t s = 0; s < read.size(); ++s)
    read[s] = std::ranges::find(fields, std::string_view(state_names[s])) != fields.end() ? 1 : 0;
  const auto note = [&](const BoundProgram& program) {
    for (size_t s = 0; s < read.size(); ++s) read[s] = read[s] != 0 || program.states[s] >= 0;
  };
  if (rate) note(rate->program);
  for (const LossEvent& event : events) {
    const std::optional<BoundLossAdjoint>& adjoint = terms[event.term].adjoint;
    if (event.step < last_loss && adjoint) note(adjoint->program);
  }
  return read;
}

/// Beyond the first pass: by the plan, and those inside of blocks.
int64_t Rollout::Impl::recomputed_steps(int slots) {
  if (last_loss == 0) return 0;
  if (marks.empty())
    return 1 + checkpoint::advanced_steps(last_loss, slots) -
           last_loss;                              // of legs that are steps: no need to go through them
  int64_t made = mark(legs()) - mark(legs() - 1);  // the last leg, for the losses at its end
  checkpoint::Schedule schedule(legs(), slots);
  while (const std::optional<checkpoint::Action> action = schedule.next()) {
    if (action->kind == checkpoint::ActionKind::advance) made += mark(action->to) - mark(action->from);
  }
  return made - last_loss + (last_loss - legs());
}

/// For so many stored states, the initial one among them, and two to work in. Where all are stored no step is made
/// again: of states that nothing reads on the way back three are enough.
void Rollout::Impl::plan_buffers(int slots, const std::vector<char>& read) {
  buffer_count = std::max(slots + 1, 3);
  buffers_of_state.assign(state_names.size(), buffer_count);
  if (!keeps_trajectory || slots < last_loss - 1 || has_parts() || !marks.empty()) return;
  for (size_t s = 0; s < read.size(); ++s) {
    if (read[s] == 0) buffers_of_state[s] = 3;
  }
}

/// With the seeds, which take a buffer more.
int64_t Rollout::Impl::bytes_of_states() const {
  const auto states = static_cast<int64_t>(state_names.size());
  return std::accumulate(buffers_of_state.begin(), buffers_of_state.end(), states + kept_fields()) *
         FieldPool::stride_of(setup.layout);
}

/// As many as there are where memory allows; those of setup.slots where it says so.
int Rollout::Impl::plan_slots(const std::vector<char>& read) {
  const int all = std::max(legs() - 1, 1);
  if (setup.slots > 0) return std::min(setup.slots, all);
  plan_buffers(all, read);
  if (bytes_of_states() <= setup.checkpoint_bytes) return all;
  const auto states = static_cast<int64_t>(state_names.size());
  return checkpoint::slots_for(setup.checkpoint_bytes, states * FieldPool::stride_of(setup.layout), legs());
}

/// Subgrids differ in size; what is made again is made by all ranks.
int Rollout::Impl::least_of_ranks(int64_t slots) const {
  return static_cast<int>(-largest_of(setup.ranks, -static_cast<double>(slots)));
}

/// How many states gradient() stores, and when it makes the others again.
void Rollout::Impl::plan_storage() {
  int slots = 1;
  std::vector<char> read;
  if (backward && setup.steady == 0) {
    read = states_read(*setup.adjoint);
    keeps_trajectory = std::ranges::find(read, char{1}) != read.end();
    plan_reverse_block();
    take_total_adjoint();
  }
  if (keeps_trajectory) {
    slots = least_of_ranks(plan_slots(read));
    if (slots >= last_loss - 1 && keeps_less_than(read)) {
      read = states_read(*setup.kept_adjoint);
      take_kept_adjoint();
    }
    if (purpose == Purpose::run) reversal = Reversal(legs(), slots);
    result.stored_states = slots - 1;
    result.recomputed_steps = recomputed_steps(slots);
  }
  plan_buffers(slots, read);
  result.checkpoint_bytes = planned_bytes = backward ? bytes_of_states() : 0;
  // What the states between steps leave of the budget is for tapes and for the states between the parts of a step; two
  // more are worked in.
  const int64_t unused = std::max<int64_t>(setup.checkpoint_bytes - planned_bytes, 0);
  if (backward && setup.steady == 0) plan_tapes(has_parts() ? unused / 2 : unused);
  const int64_t state_bytes = static_cast<int64_t>(state_names.size()) * FieldPool::stride_of(setup.layout);
  const int64_t left = (unused - result.tape_bytes) / state_bytes - 2;
  part_slots =
      setup.slots > 0 ? setup.slots : least_of_ranks(std::clamp<int64_t>(left, 1, std::numeric_limits<int>::max() - 1));
}

/// What a plan counts is what a run takes, since both come here.
FieldPool Rollout::Impl::make_pool(const dpde_layout& layout, int64_t count, const std::string& folder) {
  if (folder.empty()) bytes_of_fields += allocated_bytes(count * FieldPool::stride_of(layout));
  return purpose == Purpose::plan ? FieldPool() : FieldPool(layout, count, folder);
}

void Rollout::Impl::allocate_states() {
  const auto states = static_cast<int64_t>(state_names.size());
  const auto bar_count = sought.empty() ? 0 : static_cast<int64_t>(sought.back().first + sought.back().count);
  bar_layout = setup.layout;
  bar_layout.real = DPDE_F64;
  pool = make_pool(setup.layout, std::accumulate(buffers_of_state.begin(), buffers_of_state.end(), int64_t{0}),
                   backward ? setup.checkpoint_folder : "");
  if (keeping) keeping->pool = make_pool(setup.layout, kept_fields());
  if (backward) {
    bar_pool = make_pool(setup.layout, 3 * states);
    field_bar_pool = make_pool(bar_layout, bar_count);
    if (setup.layout.real == DPDE_F32 && !backward->totals.empty())
      single_totals = make_pool(setup.layout, static_cast<int64_t>(backward->totals.size()));
  }
  if (purpose == Purpose::plan) return;
  buffers.emplace_back();
  for (Field& field : initial) buffers.front().push_back(field.base());
  int64_t next = 0;
  for (int64_t b = 0; b < buffer_count; ++b) {
    StateBuffer buffer;
    for (size_t s = 0; s < state_names.size(); ++s)
      buffer.push_back(b < buffers_of_state[s] ? pool.base(next++) : buffers[static_cast<size_t>(b - 2)][s]);
    buffers.push_back(std::move(buffer));
  }
  final_states = buffers.front();
  if (!backward) return;
  for (int64_t b = 0; b < 3; ++b) {
    StateBuffer& buffer = bars.emplace_back();
    for (int64_t s = 0; s < states; ++s) buffer.push_back(bar_pool.base(b * states + s));
  }
  for (int64_t i = 0; i < bar_count; ++i) result.field_bars.push_back({&bar_layout, field_bar_pool.base(i)});
  is_seeded.assign(state_names.size(), 0);
  result.state_bars.assign(state_names.size(), {});
}

}  // namespace dpde
