// SPDX-License-Identifier: Apache-2.0
// Cost of a kernel per point, for passes that choose between equivalent forms.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Number of instructions. An addition next to a multiplication is free (FMA), and so are uniform expressions.
int instructions(const Kernel& kernel);
/// Number of distinct reads (field and offset).
int loads(const Kernel& kernel);
/// Number of fields that pass through memory: read at any offset, or written; an adding store counts as both.
int streams(const Kernel& kernel);

}  // namespace dpde::stencil
