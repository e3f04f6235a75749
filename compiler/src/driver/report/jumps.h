// SPDX-License-Identifier: Apache-2.0
// Coefficients that jump inside the flux of a difference. The mean of both sides at a face is then not the flux, and
// the error is O(1) whatever the order of the differences.
#pragma once

#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

struct Jump {
  std::string name;        // coefficient, mask or operator; "if(...)" in the equation itself
  bool is_factor = false;  // a factor of the flux, so that it can be inverted; not a mask
  SourceRange range;       // of the difference, or of the line
  std::string inside;      // for a harmonic mean: "at x = 0.51, between the faces 0.5 and 0.53125"; else ""
};

/// Lists each name once. A formula in a coefficient or equation jumps if its branches do not meet where coordinates or
/// states switch them (model/analyse/switches.h). A coefficient from a file jumps if its difference between adjacent
/// cells is comparable with that over four cells. In grad(u)/interpolate(1/k) a jump at grid faces is correct, as the
/// flux is the harmonic mean there. A jump inside a cell is not: the mean treats cells as uniform.
std::vector<Jump> jumps_in_fluxes(Session& session);

}  // namespace dpde::driver
