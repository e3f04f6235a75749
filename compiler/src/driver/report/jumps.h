// SPDX-License-Identifier: Apache-2.0
// Coefficients that jump where an equation takes differences of a flux with them: the mean of both sides, as
// differences have it at a face, is not what flows there, and the error is of order 1 however high that of the
// differences is.
#pragma once

#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

struct Jump {
  std::string name;        // of a coefficient, a mask or an operator; "if(...)" in the equation itself
  bool is_factor = false;  // of the flux, and no mask, whose inverse is none
  SourceRange range;       // of the difference, or of the line
  std::string inside;      // of a harmonic mean: "at x = 0.51, between the faces 0.5 and 0.53125"; "" else
};

/// Each name once. A formula jumps, of a coefficient or in the equation, whose branches do not meet where places or
/// states switch them (model/analyse/switches.h), a file's coefficient whose values differ by about as much from a cell
/// to the next as over four cells. In grad(u)/interpolate(1/k) what jumps on faces of the grid does not: there the
/// harmonic mean is what flows. A formula of places that jumps inside a cell does: the mean takes the cells as wholes.
std::vector<Jump> jumps_in_fluxes(Session& session);

}  // namespace dpde::driver
