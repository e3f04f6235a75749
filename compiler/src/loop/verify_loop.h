// SPDX-License-Identifier: Apache-2.0
// Checks of the invariants of a loop module; called after from_stencil and in tests.
#pragma once

#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::loop {

/// One sentence for each broken invariant; empty if all hold.
std::vector<std::string> verify(const Module& module);

}  // namespace dpde::loop
