// SPDX-License-Identifier: Apache-2.0
#include "processor.h"

namespace dpde {

InstructionSet instruction_set() {
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

}  // namespace dpde
