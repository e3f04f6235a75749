// SPDX-License-Identifier: Apache-2.0
// For every processor.
#include "network/kernels/kernel_sets.h"
#include "network/kernels/vector_kernels.h"

namespace dpde::nn {

void kernels_portable(Kernels<float>& single, Kernels<double>& full) {
  single = kernels_of<float, 16, 16>();
  full = kernels_of<double, 16, 16>();
}

}  // namespace dpde::nn
