// SPDX-License-Identifier: Apache-2.0
// A sweep of one row of a 1-D grid, in the form that runs fastest: nothing is left to do but pointers and calls. Inside
// the runtime only.
#pragma once

#include <vector>

#include "dpde/kernel_abi.h"
#include "exec/sweep.h"
#include "grid/fill.h"

namespace dpde {

/// Its pointers in a frame: streams, grids, fields filled.
struct Line {
  dpde_row_fn call;
  dpde_row row;  // complete but for streams and grids
  std::vector<SweepStream> streams;
  std::vector<int> grids;
  std::vector<HaloFill> then;
  size_t frame_size() const { return streams.size() + grids.size() + then.size(); }
};

/// Whether the rows of a sweep may add to the program's sums themselves: these are consecutive.
bool is_line(const Sweep& sweep);
Line make_line(const Sweep& sweep, const dpde_layout& layout, const double* uniforms, double* sums);

}  // namespace dpde
