// SPDX-License-Identifier: Apache-2.0
// What a caller of the LLVM back end may choose.
#pragma once

namespace dpde::codegen {

struct JitOptions {
  int vector_width = 0;   // bits: 128, 256 or 512; 0 = chosen for the host
  bool variants = false;  // rows get the other code of dpde_kernel.variants, to choose from by measurement
};

}  // namespace dpde::codegen
