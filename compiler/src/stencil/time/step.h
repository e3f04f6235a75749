// SPDX-License-Identifier: Apache-2.0
// One step of a scene as its scheme wants it. A scheme that is split makes it of smaller ones, each of a part of the
// terms: `split = lie(advect, sources)` is first a step of dt(u) = (terms with advect), then one of dt(u) = (sources)
// from what the first has left. strang(a, b, c) is a and b over half of the step, c over all of it, then b and a over
// the other half: of order 2 where its parts are (Strang, SIAM J. Numer. Anal. 5, 1968, 506).
//
// Transport along the flow and split steps make constraints true once, where the step ends; other schemes do so behind
// each stage.
#pragma once

#include <string>
#include <vector>

#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

std::vector<Stage> step_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
