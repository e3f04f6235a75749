// SPDX-License-Identifier: Apache-2.0
// Sides whose value is a formula of the states there, gradient(-u^4): what they are on the wall is made anew wherever a
// state is read around, of the two cells beside it.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Whether the side's value reads a state.
bool is_of_states(const Problem& problem, const Side& side);
/// Whether that of any side does.
bool has_wall_formula(const Problem& problem, const std::vector<AxisSides>& boundary);

}  // namespace dpde::model
