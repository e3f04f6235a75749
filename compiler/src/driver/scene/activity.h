// SPDX-License-Identifier: Apache-2.0
// Variables of differentiation of a file's programs.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// For a task: its unknowns and the states. Without a scene: every input and parameter of the programs.
adjoint::Activity activity_of(const Compiled& compiled, const CompileOptions& options);

}  // namespace dpde::driver
