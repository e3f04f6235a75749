// SPDX-License-Identifier: Apache-2.0
// Doubles at whole cache lines, all 0 at first.
#pragma once

#include <cstdint>
#include <span>

#include "dpde/runtime/buffer.h"

namespace dpde {

class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::size_t size) : memory_(static_cast<std::int64_t>(size * sizeof(double))), size_(size) {}

  double* data() { return reinterpret_cast<double*>(memory_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(memory_.data()); }
  std::size_t size() const { return size_; }
  operator std::span<double>() { return {data(), size_}; }
  operator std::span<const double>() const { return {data(), size_}; }
  double& operator[](std::size_t i) { return data()[i]; }

 private:
  Buffer memory_;
  std::size_t size_ = 0;
};

}  // namespace dpde
