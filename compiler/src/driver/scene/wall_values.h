// SPDX-License-Identifier: Apache-2.0
// Coefficients that go on as straight lines to walls and beyond them (model/boundary/wall_coefficient.h), and what that
// makes of rough ones.
#pragma once

#include "driver/scene/session.h"

namespace dpde::driver {

/// A warning of each coefficient that has another sign on a wall than beside it: a diffusivity that is negative there
/// lets grow what it should damp. A field of the session is read only where the step's fills go on so.
void warn_of_wall_values(Session& session, DiagnosticSink& sink);

}  // namespace dpde::driver
