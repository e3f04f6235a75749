// SPDX-License-Identifier: Apache-2.0
// The processor's floating-point mode. While programs run it is set to treat subnormal numbers (below 1e-308, of floats
// below 1e-38) as 0, read or computed: they take a hundred times as long as others, and say nothing that a step could
// use.
//
// The mode belongs to a thread. Whoever runs programs holds a FloatScope, in every back end: none keeps a subnormal
// number. A product that one back end rounds and another one fuses with a sum may be 0 or the smallest normal number.
// Hosts have their own mode again when it ends, by an exception too. Elsewhere than on x86 and 64-bit ARM nothing is
// set.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace dpde {

using FloatMode = std::uint64_t;

/// That of this thread; what its computations have raised is no part of it.
inline FloatMode float_mode() {
#if defined(__x86_64__)
  constexpr unsigned raised = 0x3f;  // of MXCSR
  return _mm_getcsr() & ~raised;
#elif defined(__aarch64__)
  FloatMode mode;
  asm volatile("mrs %0, fpcr" : "=r"(mode));
  return mode;
#else
  return 0;
#endif
}

inline void set_float_mode([[maybe_unused]] FloatMode mode) {
#if defined(__x86_64__)
  constexpr unsigned raised = 0x3f;
  _mm_setcsr(static_cast<unsigned>(mode) | (_mm_getcsr() & raised));
#elif defined(__aarch64__)
  asm volatile("msr fpcr, %0" : : "r"(mode) : "memory");
#endif
}

/// That of this thread, but subnormal numbers are 0.
inline FloatMode mode_without_subnormals() {
#if defined(__x86_64__)
  constexpr FloatMode flush_to_zero = 1U << 15, denormals_are_zero = 1U << 6;  // of MXCSR
  return float_mode() | flush_to_zero | denormals_are_zero;
#elif defined(__aarch64__)
  constexpr FloatMode flush_to_zero = FloatMode{1} << 24;  // of FPCR: operands and results
  return float_mode() | flush_to_zero;
#else
  return float_mode();
#endif
}

/// Sets the mode, and sets it back at the end. Setting takes longer than reading: nothing is set that is set already.
class FloatScope {
 public:
  explicit FloatScope(FloatMode mode = mode_without_subnormals()) : before_(float_mode()), sets_(mode != before_) {
    if (sets_) set_float_mode(mode);
  }
  ~FloatScope() {
    if (sets_) set_float_mode(before_);
  }
  FloatScope(const FloatScope&) = delete;
  FloatScope& operator=(const FloatScope&) = delete;
  FloatMode before() const { return before_; }

 private:
  FloatMode before_;
  bool sets_;
};

}  // namespace dpde
