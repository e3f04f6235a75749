// SPDX-License-Identifier: Apache-2.0
// Whether conditions determine all ghost values that the programs of a scene read: one for each cell that a formula
// reaches beyond a side.
#pragma once

#include "driver/compile/pipeline.h"
#include "model/boundary/wall_image.h"

namespace dpde::driver {

/// Of the states with mixed conditions, and of what is computed of them between the stages of a step.
model::GhostCounts ghost_counts(const Compiled& compiled);

/// Reports the first condition with too coarse cells for one of its ghost values, for the scene's parameters.
void check_ghosts(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
