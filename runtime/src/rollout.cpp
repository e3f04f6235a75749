// SPDX-License-Identifier: Apache-2.0
// Running forward: steps, losses along the way, and the search for the first value that is not finite.
#include "dpde/runtime/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/growth.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

constexpr int check_interval = 64;  // a check reads the states once: under 1 % of 64 steps

}  // namespace

/// The fields of the interval that step n, or a loss at state n, lies in. Halos are filled when an interval begins: its
/// field may be new since the last time.
void Rollout::Impl::bind_control_fields(BoundProgram& program, int n) const {
  for (const auto& [field, number] : program.control_fields) {
    const ControlField& control = setup.control_fields[number];
    void* const now = control.at[control_interval(n, control.every, control.at.size())];
    if (program.executor.bound(field) == now) continue;
    program.executor.bind(field, now);
    if (program.executor.prepares(field)) program.executor.prepare(field);
  }
}

/// Time and controls in a part of step n, or of a loss at state n, and whatever parameters have been set since.
void Rollout::Impl::set_part(BoundProgram& program, int n, const PartOfStep& part) const {
  bind_control_fields(program, n);
  const bool sets_dt = has_parts() && program.dt_param >= 0;
  if (program.t_param >= 0) program.executor.set_param(program.t_param, time(n) + part.begin);
  if (sets_dt) program.executor.set_param(program.dt_param, part.length);
  for (const auto& [param, number] : program.controls) {
    program.executor.set_param(param, controls[number].at(n));
  }
  program.executor.update_uniforms();
}

void Rollout::Impl::update_weights() {
  if (!setup.weights.empty()) for_each_program([](BoundProgram& program) { program.executor.update_weights(); });
}

/// Fills the halos of all that the caller may have changed.
void Rollout::Impl::begin(int first) {
  far.reset();
  update_weights();
  begin_record(first);
  set_step(forward->program, first);
  forward->program.bind_states(buffers.front());
  for (size_t i = 0; i < state_names.size(); ++i) forward->program.executor.prepare(forward->program.states[i]);
  forward->program.prepare_inputs();
}

void Rollout::Impl::bind_buffers(BoundStep& step, const StateBuffer& from, const StateBuffer& to) {
  step.program.bind_states(from);
  for (size_t i = 0; i < to.size(); ++i) step.program.executor.bind(step.next[i], to[i]);
}

/// A solve that finds nothing says in which step, and when the part of it begins that it belongs to.
void Rollout::Impl::run_in_step(Executor& executor, int n, double begin) const {
  try {
    executor.run();
  } catch (Unsolved& error) {
    error.set_place(n + 1, setup.steps, time(n) + begin);
    throw;
  }
}

/// And one of a loss, at which time.
void Rollout::Impl::run_at_state(Executor& executor, int k) const {
  try {
    executor.run();
  } catch (Unsolved& error) {
    error.set_place(0, setup.steps, time(k));
    throw;
  }
}

/// The first step behind n at which a control field has another interval.
int Rollout::Impl::end_of_intervals(int n) const {
  int end = std::numeric_limits<int>::max();
  for (const ControlField& control : setup.control_fields) {
    const size_t next = control_interval(n, control.every, control.at.size()) + 1;
    if (next < control.at.size()) end = std::min(end, static_cast<int>(next) * control.every);
  }
  return end;
}

/// How many of the steps n .. until - 1 are done in one go.
int Rollout::Impl::steps_at_once(int n, int until) const {
  return forward->block && std::min(until, end_of_intervals(n)) - n >= forward->block->steps() ? forward->block->steps()
                                                                                               : 1;
}

void Rollout::Impl::steps(int n, int count, const StateBuffer& from, const StateBuffer& to) {
  if (count == 1) return step(n, from, to);
  run_block(*forward->block, n, from, to);
}

void Rollout::Impl::add_losses(std::span<const LossEvent> due, int k, const StateBuffer& state) {
  for (const LossEvent& event : due) {
    BoundTerm& term = terms[event.term];
    BoundProgram& program = term.loss.program;
    for (const BoundData& data : term.loss.data) program.executor.bind(data.field, data.at[event.entry]);
    set_step(program, k);
    program.bind_states(state);
    program.prepare_inputs();
    run_at_state(program.executor, k);
    const double value = term.weight * program.executor.sums()[static_cast<size_t>(term.loss.sum)];
    (term.average < 0 ? loss_value : averages[static_cast<size_t>(term.average)].value) += value;
  }
  if (due.empty() || due.front().step != last_loss) return;
  add_losses_of_averages();
  look_at_growth(k, state);
}

/// Beyond reason it is as little a result as states that are not finite; where it is far, the state is kept, which the
/// way back may write over. Of the whole grid, so that all ranks say the same.
void Rollout::Impl::look_at_growth(int k, const StateBuffer& state) {
  const auto magnitude = [&](const void* base) {
    return largest_of(setup.ranks, largest_magnitude(setup.layout, base));
  };
  bool is_far = false;
  for (size_t s = 0; s < state.size(); ++s) {
    const double before = magnitude(buffers.front()[s]), now = magnitude(state[s]);
    is_far = is_far || (before > 0 && now > suspicious_growth * before);
    if (grows_beyond_reason(before, now)) loss_value = std::numeric_limits<double>::quiet_NaN();
  }
  if (!is_far || std::isnan(loss_value)) return;
  FarState found{.before = {}, .states = {}, .step = k, .t = time(k)};
  for (size_t s = 0; s < state.size(); ++s) {
    found.before.push_back(magnitude(buffers.front()[s]));
    if (far_fields.size() == s) far_fields.emplace_back(setup.layout, static_cast<int>(s));
    copy_all(setup.layout, far_fields[s].base(), state[s]);
    found.states.push_back(far_fields[s].base());
  }
  far = std::move(found);
}

/// A working buffer that is neither a nor b.
int Rollout::Impl::free_buffer(int a, int b) const {
  int buffer = 1;
  while (buffer == a || buffer == b) ++buffer;
  return buffer;
}

/// The first value that is not finite. Of ranks it is the one whose cell has the smallest number in the whole grid.
std::optional<Cell> Rollout::Impl::find_bad_cell(const void* state, double& value) const {
  const dpde_layout& layout = setup.layout;
  const std::optional<Cell> own = find_not_finite(layout, state);
  if (own) value = value_at(layout, state, *own);
  if (setup.ranks == nullptr) return own;
  const Cell there = own.value_or(Cell{});
  const auto [x, y, z] = std::array{there.x + layout.first[0], there.y + layout.first[1], there.z + layout.first[2]};
  const double number = own ? static_cast<double>((z * layout.global[1] + y) * layout.global[0] + x) : INFINITY;
  const double first = -largest_of(setup.ranks, -number);
  if (std::isinf(first)) return std::nullopt;
  value = first == number ? value : 0;
  setup.ranks->sum({&value, 1});
  const auto cell = static_cast<int64_t>(first), row = cell / layout.global[0];
  return Cell{cell % layout.global[0], row % layout.global[1], row / layout.global[1]};
}

std::optional<BlowUp> Rollout::Impl::find_blow_up(int step, const StateBuffer& state) const {
  for (size_t i = 0; i < state.size(); ++i) {
    double value = 0;
    if (const std::optional<Cell> cell = find_bad_cell(state[i], value))
      return BlowUp{step, time(step), static_cast<int>(i), *cell, value};
  }
  return std::nullopt;
}

/// State `from`, in buffer `safe`, is finite, the one of `found` is not: finds the first bad one; `current` is then the
/// last good one.
BlowUp Rollout::Impl::locate_blow_up(int from, int safe, const BlowUp& found) {
  current = safe;
  for (int n = from; n < found.step; ++n) {
    const int next = free_buffer(current, current);
    step(n, buffers[static_cast<size_t>(current)], buffers[static_cast<size_t>(next)]);
    if (const std::optional<BlowUp> first = find_blow_up(n + 1, buffers[static_cast<size_t>(next)])) return *first;
    current = next;
  }
  return found;
}

namespace {

/// While a run goes on, however it ends.
class PartsSeen {
 public:
  PartsSeen(const Observer*& at, const Observer& observer) : at_(at) {
    at_ = observer.sees_parts && observer.call ? &observer : nullptr;
  }
  ~PartsSeen() { at_ = nullptr; }
  PartsSeen(const PartsSeen&) = delete;
  PartsSeen& operator=(const PartsSeen&) = delete;

 private:
  const Observer*& at_;
};

}  // namespace

RunResult Rollout::Impl::run(const Observer& observer, int first) {
  const FloatScope without_subnormals;
  host_mode = without_subnormals.before();
  start = std::chrono::steady_clock::now();
  RunResult done;
  parts_made = parts_refused = 0;
  const PartsSeen seen(observer_of_parts, observer);
  begin(first);
  current = 0;
  int safe = 0, safe_step = first, k = first, until = first, end = setup.steps;  // end: may become earlier
  const bool observes = observer.every > 0 && observer.call;
  const auto finish = [&](int at) {
    done.steps_done = at;
    done.parts = has_parts() ? parts_made : at - first;
    done.refused = parts_refused;
    final_states = buffers[static_cast<size_t>(current)];
    done.seconds = seconds_since(start);
    return done;
  };
  const auto observe = [&] {
    const FloatScope of_host(without_subnormals.before());
    observer.call({k, time(k), buffers[static_cast<size_t>(current)], k == end});
  };
  // Of the step that has led to state k; only the last one's change is wanted as a number.
  const auto look_for_steady = [&](const StateBuffer& from, const StateBuffer& to) {
    const bool is_reached = is_still(from, to);
    if (is_reached) end = until = k;
    if (k == end) done.steady = Steady{is_reached, k, time(k), largest_change(from, to)};
  };
  if ((done.blow_up = find_blow_up(first, buffers.front()))) return finish(first);
  if (observes) observe();
  while (k < end) {
    const int observed = observes ? (k / observer.every + 1) * observer.every : end;
    until = std::min({end, safe_step + check_interval, observed});
    while (k < until) {
      if (stopping()) {
        done.stopped = true;
        return finish(k);
      }
      const int next = free_buffer(current, safe), count = steps_at_once(k, until);
      const StateBuffer &from = buffers[static_cast<size_t>(current)], &to = buffers[static_cast<size_t>(next)];
      steps(k, count, from, to);
      current = next;
      k += count;
      if (setup.steady > 0) look_for_steady(from, to);
    }
    if (k == end || k == safe_step + check_interval) {
      if (const std::optional<BlowUp> found = find_blow_up(k, buffers[static_cast<size_t>(current)])) {
        observer_of_parts = nullptr;  // it has seen them
        done.blow_up = locate_blow_up(safe_step, safe, *found);
        return finish(done.blow_up->step - 1);
      }
      safe = current;
      safe_step = k;
    }
    if (observes && (k == end || k == observed)) observe();
  }
  return finish(k);
}

void Rollout::Impl::restart() {
  update_weights();
  begin_record(0);
  reached = 0;
  current = 1;
  for (size_t i = 0; i < initial.size(); ++i) {
    copy_all(setup.layout, buffers[1][i], initial[i].base());
  }
  final_states = buffers[1];
}

RunResult Rollout::Impl::advance(int count) {
  const FloatScope without_subnormals;
  start = std::chrono::steady_clock::now();
  RunResult done;
  if (reached > 0) begin_record(reached);
  set_step(forward->program, reached);
  forward->program.bind_states(buffers[static_cast<size_t>(current)]);
  for (const int field : forward->program.states) forward->program.executor.prepare(field);
  forward->program.prepare_inputs();
  for (const int until = reached + count; reached < until && !(done.stopped = stopping());) {
    const int next = free_buffer(current, current), now = steps_at_once(reached, until);
    steps(reached, now, buffers[static_cast<size_t>(current)], buffers[static_cast<size_t>(next)]);
    current = next;
    reached += now;
  }
  done.steps_done = reached;
  final_states = buffers[static_cast<size_t>(current)];
  done.seconds = seconds_since(start);
  return done;
}

double Rollout::Impl::loss() {
  const FloatScope without_subnormals;
  host_mode = without_subnormals.before();
  begin();
  begin_averages();
  loss_value = 0;
  current = 0;
  steps_worked = 0;
  result.stopped = false;
  if (setup.steady > 0) {
    const std::optional<Steady> steady = run_to_steady();
    if (!steady) return std::numeric_limits<double>::quiet_NaN();
    add_losses(events_at(setup.steps), steady->step, buffers[static_cast<size_t>(current)]);
    return loss_value;
  }
  add_losses(0, buffers.front());
  for (int n = 0, until = 0; n < last_loss;) {  // until: where the next loss is
    result.stopped = stopping();
    if (result.stopped) return std::numeric_limits<double>::quiet_NaN();
    if (n == until) until = std::ranges::upper_bound(events, n, {}, &LossEvent::step)->step;
    const int next = free_buffer(current, current), count = steps_at_once(n, until);
    steps(n, count, buffers[static_cast<size_t>(current)], buffers[static_cast<size_t>(next)]);
    current = next;
    n += count;
    if (n == until) add_losses(n, buffers[static_cast<size_t>(current)]);
    result.stopped = !go_on(n, count, last_loss, false);
    if (result.stopped) return std::numeric_limits<double>::quiet_NaN();
  }
  return loss_value;
}

}  // namespace dpde
