// SPDX-License-Identifier: Apache-2.0
// A scene written again for its lowered step, so that the stencil stage of a scene is a file that runs.
#pragma once

#include <string>

#include "driver/pipeline.h"

namespace dpde::driver {

/// `scene NAME : NAME_step { ... }` with the grid, parameters, coefficients, initial states, exact solutions, times and
/// observables of the problem, overrides applied. Boundaries stand in the program's fills. "" of staggered problems: a program
/// does not say where its fields lie.
std::string scene_text(const Compiled& compiled);

}  // namespace dpde::driver
