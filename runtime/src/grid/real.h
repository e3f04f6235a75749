// SPDX-License-Identifier: Apache-2.0
// Dispatch from the element type of a layout, known at run time, to a C++ type: one branch for a whole loop. Inside the
// runtime only.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// Calls `f` with a value of the type given by `real` (DPDE_F64, DPDE_F32).
template <class F>
decltype(auto) with_real(int32_t real, const F& f) {
  return real == DPDE_F32 ? f(float{}) : f(double{});
}

/// `base` advanced by `elements` elements of `bytes` bytes.
inline char* moved(void* base, int64_t elements, int64_t bytes) { return static_cast<char*>(base) + elements * bytes; }
inline const char* moved(const void* base, int64_t elements, int64_t bytes) {
  return static_cast<const char*>(base) + elements * bytes;
}

}  // namespace dpde
