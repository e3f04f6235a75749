// SPDX-License-Identifier: Apache-2.0
// The largest stable step on a scene's own grid.
#pragma once

#include "stability/step/own_grid.h"
#include "stability/step_limit.h"

namespace dpde::stability {

inline constexpr double shortest = 1e-3, farthest = 4096;  // steps that are tried, as multiples of the scene's

/// `own_step`: the length of the scene's step or substep. The search begins at the limit of waves if there is one, else
/// at that step.
StepLimit limit_on(const OwnGrid& grid, double own_step, const StepLimit& by_waves);

}  // namespace dpde::stability
