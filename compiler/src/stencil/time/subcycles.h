// SPDX-License-Identifier: Apache-2.0
// Equations that make several steps within each: the others go first, in one step that sees these where it begins; then
// these, in `parts` equal steps that see the others on the straight line from their old to their new values. With n
// parts of their own, slowest first (Gear and Wells 1984, "Multirate linear multistep methods", BIT 24). What acts in
// one direction only, from the slow to the fast, keeps the order of the scheme up to 2; with action in both directions
// the order is 1. The parts are the passes of a repeat.
#pragma once

#include <string>
#include <vector>

#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// One step of all equations; a kernel of those that make one step each is called `name`.
std::vector<Stage> subcycled_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
