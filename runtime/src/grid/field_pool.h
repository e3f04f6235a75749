// SPDX-License-Identifier: Apache-2.0
// Memory of many fields of one layout. Inside the runtime only.
#pragma once

#include <cstdint>
#include <string>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/buffer.h"

namespace dpde {

/// Equal arrays with one layout in one allocation; with `folder` in an unnamed file there, which is removed with the
/// pool.
class FieldPool {
 public:
  FieldPool() = default;
  FieldPool(const dpde_layout& layout, int64_t count, const std::string& folder = {});
  void* base(int64_t number) const { return memory_.data() + number * stride_ + origin_; }
  void touch() const { memory_.touch(); }
  /// Bytes from one array to the next: equal for all pools of the layout.
  static int64_t stride_of(const dpde_layout& layout);

 private:
  Buffer memory_;
  int64_t stride_ = 0, origin_ = 0;  // bytes
};

}  // namespace dpde
