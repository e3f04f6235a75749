// SPDX-License-Identifier: Apache-2.0
// AVX-512; CMakeLists.txt has the flags.
#include "network/kernels/kernel_sets.h"
#include "network/kernels/vector_kernels.h"

namespace dpde::nn {

void kernels_v4(Kernels<float>& single, Kernels<double>& full) {
  single = kernels_of<float, 64, 32>();
  full = kernels_of<double, 64, 32>();
}

}  // namespace dpde::nn
