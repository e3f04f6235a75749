// SPDX-License-Identifier: Apache-2.0
// All parts of the reverse pass. Inside the runtime only.
#pragma once

#include "run/reverse/legs.h"

namespace dpde {

struct WayBack {
  WayBack(const ResolvedSetup& setup, const StepInputs& inputs, Stepper& stepper, Losses& losses, GradientSums& sums,
          size_t states, Binder& binder)
      : bars(setup, states),
        adjoint(setup, inputs, stepper, sums, bars, binder),
        seeds(inputs, losses, sums, bars),
        legs(setup, inputs, stepper, losses, sums, bars, adjoint, seeds) {}
  WayBack(const WayBack&) = delete;
  WayBack& operator=(const WayBack&) = delete;

  AdjointStates bars;
  StepAdjoint adjoint;
  LossSeeds seeds;
  Legs legs;
};

}  // namespace dpde
