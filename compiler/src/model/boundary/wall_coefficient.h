// SPDX-License-Identifier: Apache-2.0
// Values of coefficients beyond walls; coefficients have no boundary conditions.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Whether a value or slope at the axis' walls uses the coefficient extrapolated linearly from the two cells next to
/// the wall, of order 2. True if an equation reads the coefficient, or if its formula varies across the wall. Any other
/// coefficient has the value of the cell at each point of the wall, whether it comes from a formula, a file or a task.
bool is_led_to_walls(const Problem& problem, const Coefficient& coefficient, std::size_t axis);

/// Whether ghost cells of the coefficient at the low or high side of a bounded axis are extrapolated linearly, such
/// that its value on the wall is of order 2. This is needed where a state has a slope: k*du/dn is a flux through the
/// wall. Elsewhere the coefficient is mirrored: its error on the wall then changes the state by order 2 only, and
/// extrapolation of rough values could change their sign. It is also mirrored if a boundary condition takes its cell
/// value at the wall. A coefficient that lies on walls needs no ghost cells.
bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low);

}  // namespace dpde::model
