// SPDX-License-Identifier: Apache-2.0
// Events (after step, every, at) as part of the step: behind its last stage, chosen by the number of the step, which t
// tells. So they are differentiated, stored and compiled like everything else, and cost nothing where they fit into the
// last kernel.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lowering.h"

namespace dpde::stencil {

/// `ends`: the fields that hold the states when the stages are done; afterwards those behind the events.
void add_events(Lowering& lowering, std::vector<Stage>& stages, std::map<std::string, std::string>& ends);

}  // namespace dpde::stencil
