// SPDX-License-Identifier: Apache-2.0
// What a caller of the LLVM back end may choose.
#pragma once

namespace dpde::codegen {

struct JitOptions {
  int vector_width = 0;   // bits: 128, 256 or 512; 0 = chosen for the host
  bool variants = false;  // rows get the other code of dpde_kernel.variants, to choose from by measurement
  /// Compiled in a sixth of the time, for rows that run for less than that: cell by cell, and every value has a place
  /// in memory. Products are fused where they always are, so that results are those of cells that fill no vector.
  bool quick = false;
};

}  // namespace dpde::codegen
