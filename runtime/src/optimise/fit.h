// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dpde/kernel_abi.h"

namespace dpde {

/// @throws Error(run) if the program's version, rank, precision or halo does not fit the layout, or if the layout is a
/// subgrid and the program has operations that are not supported on several ranks.
void check_fits(const dpde_program& program, const dpde_layout& layout);

}  // namespace dpde
