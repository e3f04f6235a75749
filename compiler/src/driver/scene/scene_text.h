// SPDX-License-Identifier: Apache-2.0
// A scene written again for its lowered step, so that the stencil stage of a scene is a file that runs.
#pragma once

#include <string>

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// `scene NAME : NAME_step { ... }` with the grid, parameters, coefficients, initial states, exact solutions, times and
/// observables of the problem, overrides applied. Boundaries stand in the program's fills. Of a problem that holds more
/// than these can say, a comment that says what.
std::string scene_text(const Compiled& compiled);

}  // namespace dpde::driver
