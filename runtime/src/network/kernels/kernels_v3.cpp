// SPDX-License-Identifier: Apache-2.0
// AVX2 and FMA; CMakeLists.txt has the flags.
#include "network/kernels/kernel_sets.h"
#include "network/kernels/vector_kernels.h"

namespace dpde::nn {

void kernels_v3(Kernels<float>& single, Kernels<double>& full) {
  single = kernels_of<float, 32, 16>();
  full = kernels_of<double, 32, 16>();
}

}  // namespace dpde::nn
