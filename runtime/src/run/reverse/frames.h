// SPDX-License-Identifier: Apache-2.0
// If all states are stored (state k in buffer k) the pointers of every run are known in advance. Inside the runtime
// only.
#pragma once

#include <vector>

#include "run/forward/step_inputs.h"
#include "run/reverse/way_back.h"
#include "run/states.h"

namespace dpde {

class Frames {
 public:
  /// For `steps` steps; stays empty if a program has no frames.
  void make(int steps, const StepInputs& inputs, const States& states, Stepper& stepper, StepAdjoint& adjoint);
  bool empty() const { return steps_.empty(); }
  void run_step(Executor& step, int n) { step.run_frame(&steps_[static_cast<size_t>(n) * step.frame_size()]); }
  void run_adjoint(Executor& adjoint, int n) {
    adjoint.run_frame(&adjoints_[static_cast<size_t>(n) * adjoint.frame_size()]);
  }

 private:
  std::vector<void*> steps_, adjoints_;  // for step n, and for its adjoint
};

}  // namespace dpde
