// SPDX-License-Identifier: Apache-2.0
// The gradient: forward by the checkpoint plan, then the adjoints backwards, with the seeds of the losses added at
// their steps. Inside the runtime only.
#pragma once

#include <chrono>

#include "run/forward/run_watch.h"
#include "run/forward/steady_run.h"
#include "run/forward/stepper.h"
#include "run/losses.h"
#include "run/reverse/frames.h"
#include "run/reverse/trajectory.h"
#include "run/reverse/way_back.h"
#include "run/states.h"

namespace dpde {

class Gradient {
 public:
  /// All memory must have been allocated.
  Gradient(const RolloutSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper, Losses& losses,
           Trajectory& trajectory, WayBack& back, SteadyRun& steady, RunWatch& watch);

  /// From the initial state, whose halos and those of all inputs of steps are filled; returns false when stopped.
  /// `start`: for the times in `result`.
  bool run(GradientResult& result, std::chrono::steady_clock::time_point start);

 private:
  bool run_with_checkpoints();
  bool run_without_trajectory();
  bool run_frames();
  bool run_steady(std::optional<SteadyAdjoint>& report);
  bool start_reverse(int leg, const StateBuffer& state, const StateBuffer& last);
  void turn_round(int k, const StateBuffer& state);
  bool go_on(int state, int worked, bool is_back) { return watch_.go_on(inputs_.time(state), worked, is_back); }

  const RolloutSetup& setup_;
  const StepInputs& inputs_;
  States& states_;
  Stepper& stepper_;
  Losses& losses_;
  Trajectory& trajectory_;
  WayBack& back_;
  SteadyRun& steady_;
  RunWatch& watch_;
  Frames frames_;
  int front_ = 0;  // the last state whose losses were added
  std::chrono::steady_clock::time_point start_;
  double forward_seconds_ = 0;
};

}  // namespace dpde
