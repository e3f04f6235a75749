// SPDX-License-Identifier: Apache-2.0
// How much memory an array of a field's size takes.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// Bytes of whole pages, which are huge ones from 4 MiB on.
int64_t allocated_bytes(int64_t wanted);

/// Bytes that one of many fields takes on the mean: that, its shift against the others (half a page on the mean), and
/// what the system leaves free before whole pages.
int64_t bytes_of_field(const dpde_layout& layout);

/// Bytes of the fields that the passes of a repeat leave on a stack, in one piece, and of where they lie.
int64_t bytes_of_stack(const dpde_layout& layout, int64_t fields, int64_t passes);

}  // namespace dpde
