// SPDX-License-Identifier: Apache-2.0
// Environment of a scene's programs, in which hand-written adjoints are checked.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

adjoint::Surroundings surroundings_of(const Compiled& compiled);

}  // namespace dpde::driver
