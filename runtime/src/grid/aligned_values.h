// SPDX-License-Identifier: Apache-2.0
// Aligned, zero-initialised work arrays. Inside the runtime only.
#pragma once

#include <complex>
#include <cstdint>

#include "dpde/runtime/buffer.h"

namespace dpde {

template <class Real>
class AlignedValuesOf {
 public:
  AlignedValuesOf() = default;
  explicit AlignedValuesOf(std::int64_t count)
      : memory_(count * static_cast<std::int64_t>(sizeof(Real))), count_(count) {}

  Real* get() const { return reinterpret_cast<Real*>(memory_.data()); }
  /// The same memory as half as many complex numbers.
  std::complex<Real>* complex() const { return reinterpret_cast<std::complex<Real>*>(memory_.data()); }
  std::int64_t count() const { return count_; }
  explicit operator bool() const { return static_cast<bool>(memory_); }

 private:
  Buffer memory_;
  std::int64_t count_ = 0;
};
using AlignedValues = AlignedValuesOf<double>;

}  // namespace dpde
