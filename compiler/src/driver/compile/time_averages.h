// SPDX-License-Identifier: Apache-2.0
// What `over time` means for losses and tests: of all states of a run a mean is also the mean, a sum the sum, an
// integral that over time, by the trapezoidal rule; `, mean over time` and so on say it for a whole line. Of the states
// behind so many steps an integral is their sum times the step.
#pragma once

#include "model/model.h"

namespace dpde::driver {

/// The problem with each quantity `over time` rewritten so that adding its values at all states gives the quantity.
model::Problem spread_over_time(model::Problem problem);

}  // namespace dpde::driver
