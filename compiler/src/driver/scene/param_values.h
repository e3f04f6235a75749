// SPDX-License-Identifier: Apache-2.0
// Values of what the programs of a scene have as parameters.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Parameters, spacings, the step, the number of cells. What seeds and counts is not among them.
loop::ParamValues values_of(const Compiled& compiled);

}  // namespace dpde::driver
