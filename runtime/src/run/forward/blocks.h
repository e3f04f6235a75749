// SPDX-License-Identifier: Apache-2.0
// Decides when several steps, or their adjoints, are done in one pass over memory (temporal blocking). The plan, and
// with it the order of sums of the adjoints, depends on the grid and the losses, not on memory or threads. Inside the
// runtime only.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/layout.h"

namespace dpde {

constexpr double most_extra_work = 1.2;  // of blocks, by cells computed twice

/// Whether the program's fields exceed the core's own cache and blocks would read it less often. In 3-D the planes of
/// the rings are in the shared cache, and stencils that read several planes on each side are faster in tuned plain
/// sweeps (Zen 5, 192^3: 25 points by a factor of 1.35, 13 points 1.2).
inline bool may_pay_in_blocks(const dpde_program& program, const dpde_layout& layout) {
  constexpr int64_t least_bytes = 2 << 20;
  const bool reads_far_planes = program.rank == 3 && program.halo[2] > 1;
  return field_bytes(layout) * program.field_count >= least_bytes && !reads_far_planes;
}

}  // namespace dpde
