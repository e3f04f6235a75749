// SPDX-License-Identifier: Apache-2.0
// Instruction sets as LLVM and C++ compilers name them.
#pragma once

#include "dpde/instruction_set.h"

namespace dpde::codegen {

inline const char* x86_name(InstructionSet set) {
  return set == InstructionSet::v4 ? "x86-64-v4" : set == InstructionSet::v3 ? "x86-64-v3" : "x86-64";
}

}  // namespace dpde::codegen
