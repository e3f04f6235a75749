// SPDX-License-Identifier: Apache-2.0
// What a caller of the LLVM back end may choose.
#pragma once

namespace dpde::codegen {

struct JitOptions {
  int vector_width = 0;  // bits: 128, 256 or 512; 0 = chosen for the host
};

}  // namespace dpde::codegen
