// SPDX-License-Identifier: Apache-2.0
// Zeroed, aligned memory for fields and trajectories. Inside the runtime only.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// 64-byte aligned (4 KiB from one page on), all zero; free with std::free. @throws Error(machine) naming the bytes.
double* allocate_doubles(int64_t count);

/// Elements by which to shift field `number` so that bases differ modulo 4 KiB (0 for fields smaller than that).
int64_t stagger_of(const dpde_layout& layout, int number);

}  // namespace dpde
