// SPDX-License-Identifier: Apache-2.0
// From the element type of a layout, known when programs run, to a C++ type. Inside the runtime only: one branch a call
// of a loop, none inside.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// Calls `f` with a value of the type that `real` (DPDE_F64, DPDE_F32) names.
template <class F>
decltype(auto) with_real(int32_t real, const F& f) {
  return real == DPDE_F32 ? f(float{}) : f(double{});
}

/// `base` moved by that many elements of `bytes` bytes.
inline char* moved(void* base, int64_t elements, int64_t bytes) { return static_cast<char*>(base) + elements * bytes; }
inline const char* moved(const void* base, int64_t elements, int64_t bytes) {
  return static_cast<const char*>(base) + elements * bytes;
}

}  // namespace dpde
