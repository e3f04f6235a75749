// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/gradient.h"

#include <algorithm>

namespace dpde {

Gradient::Gradient(const RolloutSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper,
                   Losses& losses, Trajectory& trajectory, WayBack& back, SteadyRun& steady, RunWatch& watch)
    : setup_(setup),
      inputs_(inputs),
      states_(states),
      stepper_(stepper),
      losses_(losses),
      trajectory_(trajectory),
      back_(back),
      steady_(steady),
      watch_(watch) {
  const bool stores_all = trajectory.is_stored() && trajectory.recomputed_steps() == 0;
  if (stores_all && !has_parts(setup) && back.adjoint.kept() == nullptr)
    frames_.make(losses.last(), inputs, states, stepper, back.adjoint);
}

bool Gradient::run(GradientResult& result, std::chrono::steady_clock::time_point start) {
  start_ = start;
  front_ = 0;
  states_.go_to_first();
  back_.bars.begin();
  back_.adjoint.begin(std::max(losses_.last() - 1, 0));
  bool complete = false;
  if (setup_.steady > 0) {
    complete = run_steady(result.steady);
  } else {
    const Recording recording(trajectory_.tapes());
    losses_.add(0, states_.first());
    complete = !frames_.empty()          ? run_frames()
               : trajectory_.is_stored() ? run_with_checkpoints()
                                         : run_without_trajectory();
  }
  result.forward_seconds = forward_seconds_;
  result.tapes_used = trajectory_.tapes().used();
  return complete;
}

/// Handles the losses of the last state, which is state `k`, and sets the seeds.
void Gradient::turn_round(int k, const StateBuffer& state) {
  forward_seconds_ = seconds_since(start_);
  back_.seeds.set(k, state);
}

/// If neither the adjoint of the step nor that of an earlier loss reads a state. Returns false when stopped.
bool Gradient::run_without_trajectory() {
  const Legs& legs = back_.legs;
  for (int leg = 0; leg < legs.count(); ++leg) {
    if (watch_.stopping()) return false;
    const int next = states_.free_buffer(), end = legs.mark(leg + 1);
    states_.place(next, 0, stepper_.may_be_over(), legs.steps_of(leg) == 1 && !has_parts(setup_));
    back_.legs.run(leg, states_.now(), states_.buffer(next));
    states_.go_to(next);
    losses_.add(end, states_.now());
    if (!go_on(end, legs.steps_of(leg), false)) return false;
  }
  const StateBuffer& last = states_.now();
  turn_round(losses_.last(), last);
  for (int leg = legs.count() - 1; leg >= 0; --leg) {
    if (watch_.stopping()) return false;
    back_.legs.reverse(leg, last);
    if (!go_on(legs.mark(leg), legs.steps_of(leg), true)) return false;
  }
  return true;
}

bool Gradient::run_with_checkpoints() {
  if (losses_.last() == 0) turn_round(losses_.last(), states_.first());
  const Legs& legs = back_.legs;
  const auto buffer = [this](int i) -> const StateBuffer& { return states_.buffer(i + 1); };
  const auto advance = [&](int leg, const StateBuffer& from, const StateBuffer& to) {
    if (watch_.stopping()) return false;
    const int end = legs.mark(leg + 1);
    back_.legs.run(leg, from, to);
    if (!go_on(end, legs.steps_of(leg), false)) return false;
    if (end <= front_) return true;
    front_ = end;
    losses_.add(front_, to);
    return true;
  };
  const auto reverse = [&](int leg, const StateBuffer& state) {
    if (watch_.stopping() || !start_reverse(leg, state, trajectory_.reversal().unused(buffer))) return false;
    back_.legs.reverse(leg, state);
    return go_on(legs.mark(leg), 2 * legs.steps_of(leg) - 1, true);
  };
  return trajectory_.reversal().run(states_.first(), buffer, advance, reverse);
}

/// Called first for the last leg: makes its steps, to `last`, adds its losses, and sets the seeds.
bool Gradient::start_reverse(int leg, const StateBuffer& state, const StateBuffer& last) {
  if (front_ == losses_.last()) return true;
  back_.legs.run(leg, state, last);
  front_ = losses_.last();
  losses_.add(front_, last);
  turn_round(front_, last);
  return go_on(front_, back_.legs.steps_of(leg), false);
}

/// The same as run_with_checkpoints, but with frames.
bool Gradient::run_frames() {
  BoundProgram &step = stepper_.program(), &adjoint = back_.adjoint.program();
  const int last = losses_.last();
  for (int n = 0; n < last; ++n) {
    if (watch_.stopping()) return false;
    inputs_.set(step, n);
    frames_.run_step(step.executor, n);
    losses_.add(n + 1, states_.buffer(n + 1));
    if (!go_on(n + 1, 1, false)) return false;
  }
  turn_round(last, states_.buffer(last));
  for (int n = last; n-- > 0;) {
    if (watch_.stopping()) return false;
    const StateBuffer& state = states_.buffer(n);
    inputs_.set(adjoint, n);
    if (losses_.has(n + 1)) {
      back_.adjoint.bind(state);
      back_.adjoint.prepare_seeds();
    }
    frames_.run_adjoint(adjoint.executor, n);
    back_.adjoint.take(n);
    back_.legs.add_losses(n, state);
    if (!go_on(n, 1, true)) return false;
  }
  return true;
}

/// The loss is NaN if the run is not finite.
bool Gradient::run_steady(std::optional<SteadyAdjoint>& report) {
  report.reset();
  const std::optional<Steady> steady = steady_.run();
  if (!steady) losses_.lose();
  if (!steady) return !steady_.was_stopped();
  const StateBuffer& state = states_.now();
  const std::vector<double> unrest = steady_.unrest();
  losses_.add(losses_.at(setup_.steps), steady->step, state);
  turn_round(steady->step, state);
  report = steady_.solve_adjoint(back_, unrest);
  report->state = *steady;
  if (steady_.was_stopped()) return false;
  back_.adjoint.reverse(steady_.last_step(), state, true);
  back_.bars.zero();  // a fixed point does not depend on the initial state
  return true;
}

}  // namespace dpde
