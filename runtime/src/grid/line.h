// SPDX-License-Identifier: Apache-2.0
// A sweep over the one row of a 1-D grid, reduced to pointers and calls for speed. Inside the runtime only.
#pragma once

#include <vector>

#include "dpde/kernel_abi.h"
#include "exec/sweep.h"
#include "grid/fill.h"

namespace dpde {

/// Order of its pointers in a frame: streams, grids, filled fields.
struct Line {
  dpde_row_fn call;
  dpde_row row;  // complete except streams and grids
  std::vector<SweepStream> streams;
  std::vector<int> grids;
  std::vector<HaloFill> then;
  size_t frame_size() const { return streams.size() + grids.size() + then.size(); }
};

/// Whether rows of the sweep can add directly to the program's sums, since these are consecutive.
bool is_line(const Sweep& sweep);
Line make_line(const Sweep& sweep, const dpde_layout& layout, const double* uniforms, double* sums);

}  // namespace dpde
