// SPDX-License-Identifier: Apache-2.0
// What coefficients are beyond walls, where they have no condition.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Whether the coefficient goes on as a straight line beyond the low or high side of a bounded axis, so that it is
/// known on the wall to order 2: where a state has a slope there, k*du/dn is a flux through the wall. Elsewhere it is
/// mirrored: between values its error on the wall moves the state by order 2 only, and a line through rough values may
/// leave them with the other sign. One that a boundary itself reads is that of the cell at the wall, and one that lies
/// on walls needs no values beyond.
bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low);

}  // namespace dpde::model
