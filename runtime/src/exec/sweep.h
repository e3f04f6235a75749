// SPDX-License-Identifier: Apache-2.0
// A sweep of one row function over a grid, as stored by the executor. Inside the runtime only.
#pragma once

#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "exec/sweep_tuner.h"
#include "grid/fill.h"
#include "grid/whole_fields.h"

namespace dpde {

constexpr int64_t least_cells_for_threads = 32 * 1024;  // one thread is faster on fewer

struct SweepStream {
  int field;
  int64_t delta;  // bytes from cell (0,0,0) of the field to the stream's value at the first cell of row (0,0)
  bool is_written;
};

struct SweepRange {
  int64_t from = 0, to = 1;
  int64_t count() const { return to - from; }
};

struct Sweep {
  std::vector<dpde_variant> code;  // the row itself, and its variants
  int own = 0;                     // first of its own uniforms
  std::vector<SweepStream> streams;
  std::vector<int> grids;
  std::vector<void*> whole_grids;             // on a subgrid: replace `grids`
  const dpde_layout* whole_layout = nullptr;  // their layout
  std::vector<int> sums;                      // program sums
  std::vector<HaloFill> then;
  /// 3-D: for each field that is read in planes above, the stream that is the first to reach new memory; its row is
  /// prefetched.
  std::vector<size_t> leading;
  SweepTuner tuner;
  int64_t first = 0, count = 0;
  SweepRange y, z;
  /// Threads share contiguous parts of z, or of y if z has fewer planes than there are threads.
  int64_t parts = 1;
  bool splits_z = false;
  bool ordered = false;
  int64_t rows() const { return y.count() * z.count(); }
  /// Reads the copies on the whole grid in place of its grids.
  void read_whole(const WholeFields& fields);
};

/// The sweep of an operation (DPDE_SWEEP) of a program, divided into parts for `threads` threads if it is large enough.
Sweep make_sweep(const dpde_program& program, const dpde_operation& operation, const dpde_layout& layout, int threads);

}  // namespace dpde
