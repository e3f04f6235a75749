// SPDX-License-Identifier: Apache-2.0
// What the derivatives of a file's programs are taken with respect to.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Of a task what it seeks, and the states; without a scene every input and parameter of its programs.
adjoint::Activity activity_of(const Compiled& compiled, const CompileOptions& options);

}  // namespace dpde::driver
