// SPDX-License-Identifier: Apache-2.0
// What coefficients are beyond walls, where they have no condition.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Whether a value or slope at the axis' walls has the coefficient as the straight line through the two cells beside
/// the wall leads to it, of order 2: one that an equation reads, or whose formula varies across the wall. Another one
/// has a value for each place of the wall, that of the cell there, whether a formula, a file or a task gives it.
bool is_led_to_walls(const Problem& problem, const Coefficient& coefficient, std::size_t axis);

/// Whether the coefficient goes on as a straight line beyond the low or high side of a bounded axis, so that it is
/// known on the wall to order 2: where a state has a slope there, k*du/dn is a flux through the wall. Elsewhere it is
/// mirrored: between values its error on the wall moves the state by order 2 only, and a line through rough values may
/// leave them with the other sign. One of which a boundary takes the cell at the wall is mirrored there, and one that
/// lies on walls needs no values beyond.
bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low);

}  // namespace dpde::model
