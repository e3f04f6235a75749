// SPDX-License-Identifier: Apache-2.0
// Alignment of fields in memory. Inside the runtime only.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

constexpr int64_t line_bytes = 64, page_bytes = 4096;

/// Bytes by which to shift field `number` so that base addresses differ modulo 4 KiB (0 for fields smaller than that).
int64_t stagger_of(const dpde_layout& layout, int number);

}  // namespace dpde
