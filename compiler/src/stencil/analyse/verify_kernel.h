// SPDX-License-Identifier: Apache-2.0
// The rules of stencil.h for a single kernel.
#pragma once

#include <vector>

#include "stencil/analyse/verify_stencil.h"

namespace dpde::stencil {

void check_kernel(const Kernel& kernel, std::vector<Violation>& violations);

}  // namespace dpde::stencil
