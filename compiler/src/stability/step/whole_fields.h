// SPDX-License-Identifier: Apache-2.0
// What a step solves for, and what it reduces over space, at the initial state: a stream function depends on the
// vorticity of all places, a mean on all values, so that no frozen point says what they are there.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coarse_grid.h"

namespace dpde::stability {

/// Values in all cells of `grid`, by the name of the unknown in the model (steps of other schemes have it too) or, of
/// programs, of means and where a Fourier series solves, by the field of the compiled step (lowering numbers these in
/// the order in which equations have them, whatever the scheme is). That is run with dt = 0 at this time, where each of
/// its stages is the initial state: nothing where a solve does not bear that. No solution that makes a constraint true:
/// it is 0.
std::map<std::string, std::vector<double>> whole_fields(driver::Session& session, double t, const CoarseGrid& grid);

/// Whether the step has any.
bool has_whole_fields(const driver::Session& session);

}  // namespace dpde::stability
