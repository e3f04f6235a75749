// SPDX-License-Identifier: Apache-2.0
// The step of a scene with dt = 0: what it makes of the initial states without moving them. The session keeps what was
// found: a verdict asks for the same many times, and it may take solves.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coarse_grid.h"

namespace dpde::stability {

/// The values of these fields of the step's program at this time, in the cells of `grid`; those that are not finite are
/// left out, and all are where a solve does not bear a dt of 0. On a coarser grid than the scene's the step is run on
/// means of its states and coefficients, which is no use where a program is written for cells of one size.
std::map<std::string, std::vector<double>> after_step_of_no_length(driver::Session& session,
                                                                   const std::vector<std::string>& fields, double t,
                                                                   const CoarseGrid& grid);

/// For a step that solves. The scene's own for others: those that only reduce gain nothing, and the largest of means is
/// not the largest value. Likewise for programs written by hand, for scenes with masks, whose thin parts fewer cells
/// lose, where each step's events change what a constraint has made, and where on staggered grids more is solved for
/// than constraints.
CoarseGrid grid_of_solutions(const driver::Session& session);

}  // namespace dpde::stability
