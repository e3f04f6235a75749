// SPDX-License-Identifier: Apache-2.0
// A pass of a repeat sees no halo from outside: what stays the same in all passes is filled in each as it was filled
// before the repeat.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// What the block needs so; `filled`: the last fill of each field before it.
std::vector<Statement> fills_for(const Module& module, const Repeat& repeat, const std::map<std::string, Fill>& filled);

}  // namespace dpde::stencil
