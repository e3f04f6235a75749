// SPDX-License-Identifier: Apache-2.0
// Coefficients that are extrapolated linearly to walls and beyond (model/boundary/wall_coefficient.h), and the effect
// on rough ones.
#pragma once

#include "driver/scene/session.h"

namespace dpde::driver {

/// Warns of each coefficient whose sign on a wall differs from that in the adjacent cell: a diffusivity that is
/// negative there amplifies instead of damping. Reads only coefficients that are extrapolated.
void warn_of_wall_values(Session& session, DiagnosticSink& sink);

}  // namespace dpde::driver
