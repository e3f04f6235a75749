// SPDX-License-Identifier: Apache-2.0
// The Courant number |v| step/h, summed over the axes, of the advect() terms of an equation.
#pragma once

#include <optional>

#include "model/model.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// The largest Courant number of all equations, with the velocities at the point. nullopt if there is no advection, a
/// velocity is made of derivatives, or an axis is stretched.
std::optional<double> courant_number(const model::Problem& problem, const FrozenPoint& point, double step,
                                     const StateGroup& group = {});

}  // namespace dpde::stability
