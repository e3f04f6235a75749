// SPDX-License-Identifier: Apache-2.0
// The instruction set for which code is chosen or compiled: that of this processor, or a lower one if $DPDE_ISA is
// portable, avx2 or avx512, so that each machine can test the ones it has. Compiler and runtime use only this function.
#pragma once

#include <cstdlib>
#include <optional>
#include <string_view>

namespace dpde {

/// x86-64 levels: v3 has AVX2 and fused multiply-add, v4 has AVX-512.
enum class InstructionSet { portable, v3, v4 };

inline std::string_view word_of(InstructionSet set) {
  return set == InstructionSet::v4 ? "avx512" : set == InstructionSet::v3 ? "avx2" : "portable";
}

/// The highest one of this processor.
inline InstructionSet processor_instruction_set() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool has_v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512vl");
  if (has_v3) return has_avx512 ? InstructionSet::v4 : InstructionSet::v3;
#endif
  return InstructionSet::portable;
}

/// The one in $DPDE_ISA, if this processor has it.
inline std::optional<InstructionSet> asked_instruction_set() {
  const char* const asked = std::getenv("DPDE_ISA");
  for (int set = 0; asked != nullptr && set <= static_cast<int>(processor_instruction_set()); ++set) {
    if (asked == word_of(static_cast<InstructionSet>(set))) return static_cast<InstructionSet>(set);
  }
  return std::nullopt;
}

inline InstructionSet instruction_set() { return asked_instruction_set().value_or(processor_instruction_set()); }

}  // namespace dpde
