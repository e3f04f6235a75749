// SPDX-License-Identifier: Apache-2.0
#include "solve/rows/row_kernels.h"

#include "dpde/instruction_set.h"

namespace dpde {
namespace {

RowKernels choose() {
#if defined(__x86_64__)
  switch (instruction_set()) {
    case InstructionSet::v4: return row_kernels_v4();
    case InstructionSet::v3: return row_kernels_v3();
    case InstructionSet::portable: break;
  }
#endif
  return row_kernels_portable();
}

}  // namespace

const RowKernels& row_kernels() {
  static const RowKernels chosen = choose();
  return chosen;
}

}  // namespace dpde
