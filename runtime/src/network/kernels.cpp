// SPDX-License-Identifier: Apache-2.0
#include "kernels.h"

#include "kernel_sets.h"

namespace dpde::nn {
namespace {

struct Both {
  Kernels<float> single;
  Kernels<double> full;
};

Both choose() {
  Both chosen;
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool has_v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512vl");
  if (has_v3) {
    (has_avx512 ? kernels_v4 : kernels_v3)(chosen.single, chosen.full);
    return chosen;
  }
#endif
  kernels_portable(chosen.single, chosen.full);
  return chosen;
}

const Both& both() {
  static const Both chosen = choose();
  return chosen;
}

}  // namespace

template <>
const Kernels<float>& kernels<float>() {
  return both().single;
}
template <>
const Kernels<double>& kernels<double>() {
  return both().full;
}

}  // namespace dpde::nn
