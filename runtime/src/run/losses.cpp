// SPDX-License-Identifier: Apache-2.0
// Losses of averages, L = F(a_1, ..., a_m, p) with a_j = sum over states of s_j(x_k). The run adds up the averages,
// then F is evaluated once. Its derivatives are the weights of the adjoints of the s_j on the way back:
//
//   dL/dx_k = sum_j dF/da_j * ds_j/dx_k
//
// So a gradient needs as many runs as that of any other loss.
#include "run/losses.h"

#include <algorithm>
#include <cmath>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/growth.h"

namespace dpde {

/// Of the whole grid, so that all ranks agree.
double FarLook::magnitude(const void* base) const { return largest_of(ranks_, largest_magnitude(layout_, base)); }

/// Growth beyond reason counts as not finite.
double FarLook::look(const StateBuffer& first, int k, double t, const StateBuffer& state, double loss) {
  bool is_far = false;
  for (size_t s = 0; s < state.size(); ++s) {
    const double before = magnitude(first[s]), now = magnitude(state[s]);
    is_far = is_far || (before > 0 && now > suspicious_growth * before);
    if (grows_beyond_reason(before, now)) loss = std::numeric_limits<double>::quiet_NaN();
  }
  if (!is_far || std::isnan(loss)) return loss;
  FarState found{.before = {}, .states = {}, .step = k, .t = t};
  for (size_t s = 0; s < state.size(); ++s) {
    found.before.push_back(magnitude(first[s]));
    if (fields_.size() == s) fields_.emplace_back(layout_, static_cast<int>(s));
    copy_all(layout_, fields_[s].base(), state[s]);
    found.states.push_back(fields_[s].base());
  }
  found_ = std::move(found);
  return loss;
}

LossEvents::LossEvents(const std::vector<LossTerm>& losses) {
  for (size_t term = 0; term < losses.size(); ++term) {
    const std::vector<int>& at_steps = losses[term].at_steps;
    for (size_t entry = 0; entry < at_steps.size(); ++entry) events_.push_back({at_steps[entry], term, entry});
  }
  std::ranges::stable_sort(events_, {}, &LossEvent::step);
}

std::span<const LossEvent> LossEvents::at(int k) {
  while (next_ > 0 && events_[next_ - 1].step >= k) --next_;
  while (next_ < events_.size() && events_[next_].step < k) ++next_;
  size_t end = next_;
  while (end < events_.size() && events_[end].step == k) ++end;
  return {events_.data() + next_, end - next_};
}

void Losses::bind(Binder& binder) {
  for (size_t term = 0; term < setup_.losses.size(); ++term) terms_.push_back(binder.bind_term(term));
}

void Losses::begin() {
  value_ = 0;
  for (Average& average : averages_) average.value = average.bar = 0;
}

void Losses::add(std::span<const LossEvent> due, int k, const StateBuffer& state) {
  for (const LossEvent& event : due) {
    BoundTerm& term = terms_[event.term];
    BoundProgram& program = term.loss.program;
    for (const BoundData& data : term.loss.data) program.executor.bind(data.field, data.at[event.entry]);
    inputs_.set(program, k);
    program.bind_states(state);
    program.prepare_inputs();
    inputs_.run_at_state(program.executor, k);
    const double value = term.weight * program.executor.sums()[static_cast<size_t>(term.loss.sum)];
    (term.average < 0 ? value_ : averages_[static_cast<size_t>(term.average)].value) += value;
  }
  if (due.empty() || due.front().step != last()) return;
  add_losses_of_averages();
  value_ = far_.look(states_.first(), k, inputs_.time(k), state, value_);
}

void Losses::give_averages(BoundProgram& program) {
  for (const auto& [param, number] : program.averages) program.executor.set_param(param, averages_[number].value);
  inputs_.set(program, last());
  program.prepare_inputs();
}

void Losses::add_losses_of_averages() {
  for (BoundTerm& term : terms_) {
    if (!term.of_averages) continue;
    BoundProgram& program = term.loss.program;
    give_averages(program);
    inputs_.run_at_state(program.executor, last());
    value_ += term.weight * program.executor.sums()[static_cast<size_t>(term.loss.sum)];
  }
}

void Losses::derive_averages(const std::function<void(std::span<const double> sums, const BoundLossAdjoint&)>& take) {
  for (BoundTerm& term : terms_) {
    if (!term.of_averages || !term.adjoint) continue;
    BoundProgram& program = term.adjoint->program;
    give_averages(program);
    inputs_.run_at_state(program.executor, last());
    take(program.executor.sums(), *term.adjoint);
  }
}

void Losses::add_to_average(ValueId id, double bar) {
  const int number = setup_.averages_at()[id];
  if (number >= 0) averages_[static_cast<size_t>(number)].bar += bar;
}

void Losses::weigh_averages() {
  for (BoundTerm& term : terms_) {
    if (term.average < 0 || !term.adjoint || term.seed < 0) continue;
    const double bar = averages_[static_cast<size_t>(term.average)].bar;
    term.adjoint->program.executor.set_param(term.seed, term.weight * bar);
  }
}

}  // namespace dpde
