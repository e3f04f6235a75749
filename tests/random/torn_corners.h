// SPDX-License-Identifier: Apache-2.0
// Corners between walls along x and y whose conditions do not agree. Their values come from the axis that is filled
// last (dsl-examples/manual/grids.md, "Order of axes"), and so change where the axes are swapped.
#pragma once

#include "stencil/stencil.h"

namespace dpde::testing {

/// Whether a program of the module reads such a corner, or has a field whose values lie in one.
bool has_torn_corners(const stencil::Module& module);

}  // namespace dpde::testing
