// SPDX-License-Identifier: Apache-2.0
// What must hold between the parts of a loop module; called after from_stencil and in tests.
#pragma once

#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::loop {

/// One sentence for each broken rule; empty when all is well.
std::vector<std::string> verify(const Module& module);

}  // namespace dpde::loop
