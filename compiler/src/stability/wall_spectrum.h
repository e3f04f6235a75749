// SPDX-License-Identifier: Apache-2.0
// Growth between walls, which waves do not see: the spectral radius of a step's tangent on a small grid with the
// scene's sides and spacings, everything else frozen at one point.
#pragma once

#include "model/model.h"
#include "stability/linear_step.h"

namespace dpde::stability {

/// On 24, 8 x 8 or 5 x 5 x 5 cells at most. Not a number where the tangent gives one.
double spectral_radius_between_walls(const LinearStep& linear, const FrozenPoint& point,
                                     const std::vector<model::Axis>& axes, double step);

}  // namespace dpde::stability
