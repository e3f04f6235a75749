// SPDX-License-Identifier: Apache-2.0
// Solutions of solves and reductions over space at the initial state. A stream function depends on the vorticity
// everywhere, a mean on all values, so values at a frozen point do not determine them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coarse_grid.h"

namespace dpde::stability {

/// Values in all cells of `grid`. Keys are names of the model's unknowns, which steps of other schemes share. For
/// programs, means and spectral solves they are fields of the compiled step, which lowering numbers in the order of the
/// equations for any scheme. The step is run with dt = 0 at time t, so each stage is the initial state; empty if a
/// solve is not defined at dt = 0. Solutions that enforce a constraint are left out: they are 0.
std::map<std::string, std::vector<double>> whole_fields(driver::Session& session, double t, const CoarseGrid& grid);

/// Whether the step has such fields.
bool has_whole_fields(const driver::Session& session);

}  // namespace dpde::stability
