// SPDX-License-Identifier: Apache-2.0
// Whether it is the step that makes a loss or its gradient infinite.
#pragma once

#include <string>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// How the run from where the session begins, or from there slightly disturbed in every cell, leaves all bounds: "u
/// grows from 1 to 3e+40"; "" where it does not. The run is made anew: initial states and final states of the session
/// are others afterwards.
std::string instability(driver::Session& session);

}  // namespace dpde::analysis
