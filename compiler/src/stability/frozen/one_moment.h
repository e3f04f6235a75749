// SPDX-License-Identifier: Apache-2.0
// A step at a fixed time t of a run: an analysis varies dt independently of t.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stability {

/// The module with dt = 0 in comparisons of times: t + dt/2 < 0.5 becomes t < 0.5, so all stages are at time t.
/// Multistep schemes recognise their first steps by t < t_begin + dt/2. This condition becomes false: later steps are
/// analysed, at any step length.
stencil::Module at_one_moment(stencil::Module module, double t_begin);

}  // namespace dpde::stability
