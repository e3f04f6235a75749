// SPDX-License-Identifier: Apache-2.0
// What a kernel costs at each point, for passes that choose between ways to write it.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stencil {

/// An addition next to a multiplication costs nothing (FMA), nor does what is the same at all points.
int instructions(const Kernel& kernel);
/// Reads of a field at different offsets.
int loads(const Kernel& kernel);
/// Fields that pass through memory: read at any offset, or written; both where a store adds.
int streams(const Kernel& kernel);

}  // namespace dpde::stencil
