// SPDX-License-Identifier: Apache-2.0
#include "run/forward/forward_run.h"

#include <algorithm>

#include "dpde/runtime/float_mode.h"

namespace dpde {
namespace {

constexpr int check_interval = 64;  // a check reads the states once: under 1 % of the time of 64 steps

}  // namespace

int ForwardRun::make_steps(int n, int until, int kept) {
  const int next = states_.free_buffer(kept), count = stepper_.steps_at_once(n, until);
  states_.place(next, kept, stepper_.may_be_over(), count == 1 && !has_parts(setup_) && !compares_);
  stepper_.steps(n, count, states_.now(), states_.buffer(next));
  states_.go_to(next);
  return count;
}

/// Finds the first bad state. State `from`, in buffer `safe`, is finite, that of `found` is not. Afterwards the current
/// state is the last good one.
BlowUp ForwardRun::locate_blow_up(int from, int safe, const BlowUp& found) {
  states_.go_to(safe);
  for (int n = from; n < found.step; ++n) {
    const int next = states_.free_buffer();
    states_.place(next, 0, stepper_.may_be_over(), false);
    stepper_.step(n, states_.now(), states_.buffer(next));
    if (const std::optional<BlowUp> first = find_blow_up(n + 1, states_.buffer(next))) return *first;
    states_.go_to(next);
  }
  return found;
}

RunResult ForwardRun::run(const Observer& observer, int first, FloatMode of_host) {
  RunResult done;
  stepper_.count_parts_anew();
  PartsSeen seen(stepper_, observer, of_host);
  compares_ = setup_.steady > 0;
  states_.go_to_first();
  int safe = 0, safe_step = first, k = first, until = first, end = setup_.steps;  // end: may become earlier
  const bool observes = observer.every > 0 && observer.call;
  const auto finish = [&](int at) {
    done.steps_done = at;
    done.parts = has_parts(setup_) ? stepper_.parts_made() : at - first;
    done.refused = stepper_.parts_refused();
    final_ = states_.now();
    return done;
  };
  const auto observe = [&] {
    const FloatScope scope(of_host);
    observer.call({k, inputs_.time(k), states_.now(), k == end});
  };
  // For the step that led to state k; only the last change is computed as a number.
  const auto look_for_steady = [&](const StateBuffer& from, const StateBuffer& to) {
    const bool is_reached = steady_.is_still(from, to);
    if (is_reached) end = until = k;
    if (k == end) done.steady = Steady{is_reached, k, inputs_.time(k), steady_.largest_change(from, to)};
  };
  if ((done.blow_up = find_blow_up(first, states_.first()))) return finish(first);
  if (observes) observe();
  while (k < end) {
    const int observed = observes ? (k / observer.every + 1) * observer.every : end;
    until = std::min({end, safe_step + check_interval, observed});
    while (k < until) {
      if (watch_.stopping()) {
        done.stopped = true;
        return finish(k);
      }
      const StateBuffer& from = states_.now();
      k += make_steps(k, until, safe);
      if (setup_.steady > 0) look_for_steady(from, states_.now());
    }
    if (k == end || k == safe_step + check_interval) {
      if (const std::optional<BlowUp> found = find_blow_up(k, states_.now())) {
        seen.end();  // the repeated steps are not observed again
        done.blow_up = locate_blow_up(safe_step, safe, *found);
        return finish(done.blow_up->step - 1);
      }
      safe = states_.current();
      safe_step = k;
    }
    if (observes && (k == end || k == observed)) observe();
  }
  return finish(k);
}

void ForwardRun::restart(int step) {
  stepper_.control().begin(step);
  reached_ = step;
  states_.copy_first();
  final_ = states_.now();
}

RunResult ForwardRun::advance(int count, bool until_steady) {
  RunResult done;
  if (reached_ > 0) stepper_.control().begin(reached_);
  stepper_.prepare(reached_, states_.now());
  compares_ = until_steady;
  bool is_still = false;
  for (const int until = reached_ + count; reached_ < until && !is_still && !(done.stopped = watch_.stopping());) {
    const StateBuffer& from = states_.now();
    reached_ += make_steps(reached_, until, 0);
    if (!until_steady) continue;
    const StateBuffer& to = states_.now();
    is_still = steady_.is_still(from, to);
    if (is_still || reached_ == until)
      done.steady = Steady{is_still, reached_, inputs_.time(reached_), steady_.largest_change(from, to)};
  }
  done.steps_done = reached_;
  final_ = states_.now();
  return done;
}

bool ForwardRun::add_losses() {
  compares_ = false;
  states_.go_to_first();
  if (setup_.steady > 0) {
    const std::optional<Steady> steady = steady_.run();
    if (steady) losses_.add(losses_.at(setup_.steps), steady->step, states_.now());
    return steady.has_value();
  }
  losses_.add(0, states_.first());
  for (int n = 0, until = 0; n < losses_.last();) {  // until: the next step with a loss
    if (watch_.stopping()) return false;
    if (n == until) until = losses_.events().next_after(n);
    const int count = make_steps(n, until, 0);
    n += count;
    if (n == until) losses_.add(n, states_.now());
    if (!watch_.go_on(inputs_.time(n), count, false)) return false;
  }
  return true;
}

}  // namespace dpde
