// SPDX-License-Identifier: Apache-2.0
// When several steps, or their adjoints, are done in one pass over memory. The plan depends on the grid and the losses,
// not on memory or threads, and so do the sums of the adjoints. Inside the runtime only.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/layout.h"

namespace dpde {

constexpr double most_extra_work = 1.2;  // of blocks, for what they compute twice

/// Whether the fields of the program leave the core's own cache, and blocks read it less often. In 3-D planes of the
/// rings are read from the shared cache, and stencils that read several planes on each side are faster in tuned plain
/// sweeps (Zen 5, 192^3: 25 points 1.35 times, 13 points 1.2 times).
inline bool may_pay_in_blocks(const dpde_program& program, const dpde_layout& layout) {
  constexpr int64_t least_bytes = 2 << 20;
  const bool reads_far_planes = program.rank == 3 && program.halo[2] > 1;
  return field_bytes(layout) * program.field_count >= least_bytes && !reads_far_planes;
}

}  // namespace dpde
