// SPDX-License-Identifier: Apache-2.0
// Where the programs of a scene run: adjoints that a person gives are checked there.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

adjoint::Surroundings surroundings_of(const Compiled& compiled);

}  // namespace dpde::driver
