// SPDX-License-Identifier: Apache-2.0
// The kernels of each instruction set.
#pragma once

#include "network/kernels/kernels.h"

namespace dpde::nn {

void kernels_v4(Kernels<float>& single, Kernels<double>& full);
void kernels_v3(Kernels<float>& single, Kernels<double>& full);
void kernels_portable(Kernels<float>& single, Kernels<double>& full);

}  // namespace dpde::nn
