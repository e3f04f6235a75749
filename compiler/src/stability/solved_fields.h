// SPDX-License-Identifier: Apache-2.0
// What a step solves for, at the initial state: a stream function depends on the vorticity of all places, so that no
// frozen point says what it is there.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::stability {

/// Values in all cells, by the name of the unknown in the model (steps of other schemes have it too) or, of programs
/// and where a Fourier series solves, by the field of the compiled step. That is run with dt = 0, where each of its
/// stages is the initial state: nothing where a solve does not bear that. Nothing of problems whose solves make
/// constraints true: what these give is 0.
std::map<std::string, std::vector<double>> solved_fields(driver::Session& session);

}  // namespace dpde::stability
