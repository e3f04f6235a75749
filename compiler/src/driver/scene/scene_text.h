// SPDX-License-Identifier: Apache-2.0
// Writes a scene of its lowered step, so that the stencil stage of a scene is a file that runs.
#pragma once

#include <string>

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// `scene NAME : NAME_step { ... }` with the problem's grid, parameters, coefficients, initial states, exact solutions,
/// times and observables, overrides applied. Boundaries are in the program's fills. If the problem has more than this
/// can express, a comment that lists it.
std::string scene_text(const Compiled& compiled);

}  // namespace dpde::driver
