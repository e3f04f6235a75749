// SPDX-License-Identifier: Apache-2.0
// Meaning of `over time` for losses and tests. Over all states of a run, a mean is the mean over them, a sum the sum,
// and an integral the integral over time by the trapezoidal rule. `, mean over time` and so on apply to a whole line.
// Over states at intervals of steps, an integral is their sum times the step.
#pragma once

#include "model/model.h"

namespace dpde::driver {

/// Returns the problem with each quantity `over time` scaled so that its sum over all states is the quantity.
model::Problem spread_over_time(model::Problem problem);

}  // namespace dpde::driver
