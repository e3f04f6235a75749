// SPDX-License-Identifier: Apache-2.0
// Some loops are compiled for several instruction sets; which of them this processor has is known when a program runs.
#pragma once

namespace dpde {

/// As x86-64 numbers them: v3 has AVX2 and fused multiply-add, v4 has AVX-512.
enum class InstructionSet { portable, v3, v4 };

InstructionSet instruction_set();

}  // namespace dpde
