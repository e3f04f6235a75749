// SPDX-License-Identifier: Apache-2.0
// Doubles to work in, at whole cache lines; all 0 at first. Inside the runtime only.
#pragma once

#include <complex>
#include <cstdint>

#include "dpde/runtime/buffer.h"

namespace dpde {

class AlignedValues {
 public:
  AlignedValues() = default;
  explicit AlignedValues(std::int64_t count)
      : memory_(count * static_cast<std::int64_t>(sizeof(double))), count_(count) {}

  double* get() const { return reinterpret_cast<double*>(memory_.data()); }
  /// The same as half as many complex numbers.
  std::complex<double>* complex() const { return reinterpret_cast<std::complex<double>*>(memory_.data()); }
  std::int64_t count() const { return count_; }
  explicit operator bool() const { return static_cast<bool>(memory_); }

 private:
  Buffer memory_;
  std::int64_t count_ = 0;
};

}  // namespace dpde
