// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dpde/kernel_abi.h"

namespace dpde {

/// @throws Error(run) when the program's version, rank, precision or halo does not fit the layout, or this is a subgrid
/// and the program does what ranks cannot do together yet.
void check_fits(const dpde_program& program, const dpde_layout& layout);

}  // namespace dpde
