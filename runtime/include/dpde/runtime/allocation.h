// SPDX-License-Identifier: Apache-2.0
// Memory use of arrays of a field's size.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// Bytes rounded up to whole pages; from 4 MiB on to huge pages.
int64_t allocated_bytes(int64_t wanted);

/// Mean bytes that one of many fields occupies: its pages, its stagger against the others (half a page on average) and
/// the space that the system leaves free before whole pages.
int64_t bytes_of_field(const dpde_layout& layout);

/// Bytes of a stack that stores `fields` fields of each of `passes` passes of a repeat, pointers to them included.
int64_t bytes_of_stack(const dpde_layout& layout, int64_t fields, int64_t passes);

}  // namespace dpde
