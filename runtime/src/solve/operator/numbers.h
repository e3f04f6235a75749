// SPDX-License-Identifier: Apache-2.0
// Numbers aligned to cache lines, initially 0.
#pragma once

#include <cstdint>
#include <span>

#include "dpde/runtime/buffer.h"

namespace dpde {

template <class Real>
class NumbersOf {
 public:
  NumbersOf() = default;
  explicit NumbersOf(std::size_t size) : memory_(static_cast<std::int64_t>(size * sizeof(Real))), size_(size) {}

  Real* data() { return reinterpret_cast<Real*>(memory_.data()); }
  const Real* data() const { return reinterpret_cast<const Real*>(memory_.data()); }
  std::size_t size() const { return size_; }
  operator std::span<Real>() { return {data(), size_}; }
  operator std::span<const Real>() const { return {data(), size_}; }
  Real& operator[](std::size_t i) { return data()[i]; }

 private:
  Buffer memory_;
  std::size_t size_ = 0;
};

using Numbers = NumbersOf<double>;

}  // namespace dpde
