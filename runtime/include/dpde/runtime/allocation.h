// SPDX-License-Identifier: Apache-2.0
// How much memory an array of a field's size takes.
#pragma once

#include <cstdint>

namespace dpde {

/// Bytes of whole pages, which are huge ones from 4 MiB on.
int64_t allocated_bytes(int64_t wanted);

}  // namespace dpde
