// SPDX-License-Identifier: Apache-2.0
// Sides whose value is a formula of the states, gradient(-u^4). The value on the wall is recomputed from the two cells
// next to it wherever a state's ghost cells are read.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Whether the side's value contains a state.
bool is_of_states(const Problem& problem, const Side& side);
/// Whether the value of any side contains a state.
bool has_wall_formula(const Problem& problem, const std::vector<AxisSides>& boundary);

}  // namespace dpde::model
