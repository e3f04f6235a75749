// SPDX-License-Identifier: Apache-2.0
// A step at one moment of a run, whatever its length: an analysis holds t, and takes dt as long as it likes.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stability {

/// What compares times does so with dt = 0: all stages of a step are at its own moment, t + dt/2 < 0.5 is t < 0.5.
/// Schemes with a memory ask for their first steps by t < t_begin + dt/2: what is analysed lies behind these, however
/// long a step is, and the question is gone.
stencil::Module at_one_moment(stencil::Module module, double t_begin);

}  // namespace dpde::stability
