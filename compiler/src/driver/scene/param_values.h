// SPDX-License-Identifier: Apache-2.0
// Values of the parameters of a scene's programs.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Parameters, spacings, the step and the number of cells; without seeds and counters.
loop::ParamValues values_of(const Compiled& compiled);

}  // namespace dpde::driver
