// SPDX-License-Identifier: Apache-2.0
// Subcycles: some equations take several substeps in each step. The slow equations go first, in one step that reads the
// fast states at the start of the step. Then the fast ones take `parts` equal substeps; they read the slow states,
// interpolated linearly between old and new values. With several numbers of parts, the slowest go first (Gear and
// Wells 1984, "Multirate linear multistep methods", BIT 24). If only the slow equations act on the fast ones, the order
// of the scheme is kept up to 2; with coupling in both directions the order is 1. Substeps are the passes of a repeat.
#pragma once

#include <string>
#include <vector>

#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// One step of all equations; a kernel of the equations without substeps is called `name`.
std::vector<Stage> subcycled_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
