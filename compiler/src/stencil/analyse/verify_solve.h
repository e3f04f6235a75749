// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Errors of a solve that do not depend on its block: "solves for psi to the tolerance 2: ...".
std::vector<std::string> misfits_of(const Solve& solve);

}  // namespace dpde::stencil
