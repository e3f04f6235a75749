// SPDX-License-Identifier: Apache-2.0
// Doubles at whole cache lines, all 0 at first.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>

#include "aligned_memory.h"

namespace dpde {

class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::size_t size)
      : memory_(allocate_bytes(static_cast<std::int64_t>(size * sizeof(double)))), size_(size) {}

  double* data() { return reinterpret_cast<double*>(memory_.get()); }
  const double* data() const { return reinterpret_cast<const double*>(memory_.get()); }
  std::size_t size() const { return size_; }
  operator std::span<double>() { return {data(), size_}; }
  operator std::span<const double>() const { return {data(), size_}; }
  double& operator[](std::size_t i) { return data()[i]; }

 private:
  struct Free {
    void operator()(char* memory) const { std::free(memory); }
  };
  std::unique_ptr<char, Free> memory_;
  std::size_t size_ = 0;
};

}  // namespace dpde
