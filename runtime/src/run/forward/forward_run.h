// SPDX-License-Identifier: Apache-2.0
// Forward runs: steps, losses along the way, and the search for the first value that is not finite. Inside the runtime
// only.
#pragma once

#include "run/forward/run_watch.h"
#include "run/forward/steady_run.h"
#include "run/forward/step_inputs.h"
#include "run/forward/stepper.h"
#include "run/losses.h"
#include "run/states.h"

namespace dpde {

class ForwardRun {
 public:
  ForwardRun(const RolloutSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper, Losses& losses,
             SteadyRun& steady, RunWatch& watch)
      : setup_(setup),
        inputs_(inputs),
        states_(states),
        stepper_(stepper),
        losses_(losses),
        steady_(steady),
        watch_(watch) {}

  /// Call once the states have memory. Until a run has ended final_states() are the initial ones.
  void begin() { final_ = states_.first(); }
  /// From the initial state, which is state `first`; halos of all inputs of steps must be filled.
  RunResult run(const Observer& observer, int first, FloatMode of_host);
  /// Runs to the last loss and adds up the losses; returns false when stopped or, in runs until steady, if values are
  /// not finite.
  bool add_losses();
  /// The states at the end of run() or advance().
  const StateBuffer& final_states() const { return final_; }

  // Single steps
  void restart(int step);
  RunResult advance(int count, bool until_steady);

 private:
  BlowUp locate_blow_up(int from, int safe, const BlowUp& found);
  std::optional<BlowUp> find_blow_up(int step, const StateBuffer& state) const {
    return states_.find_blow_up(step, inputs_.time(step), state);
  }
  /// Makes steps from the current state, at most to state `until`, and makes the result current; returns their number.
  /// Buffer `kept` is not overwritten.
  int make_steps(int n, int until, int kept);

  const RolloutSetup& setup_;
  const StepInputs& inputs_;
  States& states_;
  Stepper& stepper_;
  Losses& losses_;
  SteadyRun& steady_;
  RunWatch& watch_;
  StateBuffer final_;
  int reached_ = 0;        // steps of advance() since restart()
  bool compares_ = false;  // each state is compared with the previous one
};

}  // namespace dpde
