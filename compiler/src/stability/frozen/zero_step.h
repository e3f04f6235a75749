// SPDX-License-Identifier: Apache-2.0
// The step of a scene with dt = 0: its results at the initial states. The session caches them: a verdict needs the same
// results many times, and they may need solves.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coarse_grid.h"

namespace dpde::stability {

/// The values of these fields of the step's program at time t, in the cells of `grid`. Fields that are not finite are
/// left out; all fields are if a solve is not defined at dt = 0. On a coarser grid than the scene's the step runs on
/// cell means of states and coefficients, which does not suit programs written for one cell size.
std::map<std::string, std::vector<double>> after_step_of_no_length(driver::Session& session,
                                                                   const std::vector<std::string>& fields, double t,
                                                                   const CoarseGrid& grid);

/// The grid for solutions: coarser than a large scene's, if the step solves. The scene's own grid is used
/// - for steps that only reduce: a coarser one is no faster, and the largest of means is not the largest value;
/// - for hand-written programs, and scenes with masks, whose thin parts a coarser grid loses;
/// - if events of each step change the result of a constraint;
/// - if, on staggered grids, there are solves other than constraints.
CoarseGrid grid_of_solutions(const driver::Session& session);

}  // namespace dpde::stability
