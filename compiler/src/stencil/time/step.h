// SPDX-License-Identifier: Apache-2.0
// One step of a scene by its scheme. A split scheme consists of substeps, each with a part of the terms:
// `split = lie(advect, sources)` is first a step of dt(u) = (terms with advect), then, from its result, a step of
// dt(u) = (sources). strang(a, b, c) is a and b over half of the step, c over all of it, then b and a over the other
// half: order 2 if its parts have order 2 (Strang, SIAM J. Numer. Anal. 5, 1968, 506).
//
// Semi-Lagrangian and split steps project onto constraints once, at the end of the step; other schemes do so after each
// stage.
#pragma once

#include <string>
#include <vector>

#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

std::vector<Stage> step_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
