// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/frames.h"

namespace dpde {

void Frames::make(int steps, const StepInputs& inputs, const States& states, Stepper& stepper, StepAdjoint& adjoint) {
  Executor &of_step = stepper.program().executor, &of_adjoint = adjoint.program().executor;
  const size_t step_size = of_step.frame_size(), adjoint_size = of_adjoint.frame_size();
  if (step_size == 0 || adjoint_size == 0 || !adjoint.program().fill_states.empty()) return;
  steps_.resize(static_cast<size_t>(steps) * step_size);
  adjoints_.resize(static_cast<size_t>(steps) * adjoint_size);
  for (int n = 0; n < steps; ++n) {
    inputs.bind_control_fields(stepper.program(), n);
    inputs.bind_control_fields(adjoint.program(), n);
    stepper.bind(states.buffer(n), states.buffer(n + 1));
    of_step.make_frame(&steps_[static_cast<size_t>(n) * step_size]);
    adjoint.bind_totals(n);
    adjoint.bind(states.buffer(n), (steps - 1 - n) % 2 != 0);
    of_adjoint.make_frame(&adjoints_[static_cast<size_t>(n) * adjoint_size]);
  }
}

}  // namespace dpde
