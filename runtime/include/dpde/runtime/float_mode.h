// SPDX-License-Identifier: Apache-2.0
// The processor's floating-point mode. While programs run, subnormal numbers (below 1e-308; floats: below 1e-38) are
// treated as 0 when read or computed: they are about a hundred times as slow as other numbers and irrelevant to a step.
//
// The mode belongs to a thread. Code that runs programs holds a FloatScope, in every back end, so that none keeps a
// subnormal number. Back ends may still differ there: one rounds a product that another fuses with a sum, and gets 0 or
// the smallest normal number. At the end of the scope, also by an exception, the host's own mode is restored. Other
// processors than x86 and 64-bit ARM: no effect.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace dpde {

using FloatMode = std::uint64_t;

/// The mode of this thread, without the exception flags that computations have raised.
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

/// The mode of this thread with subnormal numbers treated as 0.
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

/// Sets the mode and restores the old one at the end. Writing the register is slower than reading it, so an equal mode
/// is not written.
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
