// SPDX-License-Identifier: Apache-2.0
// Zeroed, aligned memory for fields and trajectories. Inside the runtime only.
#pragma once

#include <cstdint>
#include <string>

#include "dpde/kernel_abi.h"

namespace dpde {

constexpr int64_t line_bytes = 64, page_bytes = 4096;

/// 64-byte aligned (4 KiB from one page on, 2 MiB and in huge pages where there are some from 4 MiB on), all zero; free
/// with std::free. @throws Error(machine) naming the bytes.
char* allocate_bytes(int64_t bytes);

/// The same in a file of the folder, whose room is taken at once so that a full disk is told here; it has no name and
/// vanishes with the mapping. @throws Error(machine) naming the folder.
char* map_file(const std::string& folder, int64_t bytes);
void unmap_file(char* memory, int64_t bytes);

/// Bytes by which to shift field `number` so that bases differ modulo 4 KiB (0 for fields smaller than that).
int64_t stagger_of(const dpde_layout& layout, int number);

}  // namespace dpde
