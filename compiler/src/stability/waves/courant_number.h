// SPDX-License-Identifier: Apache-2.0
// |v| step/h, summed over the axes, of what an equation's advect() carries.
#pragma once

#include <optional>

#include "model/model.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// The largest of all equations, with the velocities of the point. nullopt where nothing is carried, a velocity is made
/// of derivatives, or an axis is stretched.
std::optional<double> courant_number(const model::Problem& problem, const FrozenPoint& point, double step,
                                     const StateGroup& group = {});

}  // namespace dpde::stability
