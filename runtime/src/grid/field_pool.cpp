// SPDX-License-Identifier: Apache-2.0
#include "grid/field_pool.h"

#include <fmt/format.h>

#include "base/aligned_memory.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"

namespace dpde {

int64_t FieldPool::stride_of(const dpde_layout& layout) {
  const int64_t bytes = field_bytes(layout);
  if (bytes < page_bytes) return (bytes + line_bytes - 1) / line_bytes * line_bytes;
  return (bytes + page_bytes - 1) / page_bytes * page_bytes +
         5 * line_bytes;  // 320 bytes: so neighbours differ modulo 4 KiB
}

FieldPool::FieldPool(const dpde_layout& layout, int64_t count, const std::string& folder)
    : stride_(stride_of(layout)), origin_(layout.origin * real_bytes(layout)) {
  int64_t bytes = 0;
  if (__builtin_mul_overflow(stride_, count, &bytes) || bytes > (int64_t{1} << 62)) {
    throw Error(ErrorKind::machine,
                fmt::format("there is no memory for {} fields of {} bytes", count, field_bytes(layout)));
  }
  if (count == 0) return;
  memory_ = folder.empty() ? Buffer(bytes) : Buffer(folder, bytes);
}

int64_t bytes_of_stack(const dpde_layout& layout, int64_t fields, int64_t passes) {
  constexpr int64_t most = int64_t{1} << 50;  // above any machine's memory; sums of some of these do not overflow
  int64_t bytes = 0;
  const bool is_too_large = __builtin_mul_overflow(FieldPool::stride_of(layout), fields, &bytes) || bytes > most;
  return allocated_bytes(is_too_large ? most : bytes) + passes * static_cast<int64_t>(sizeof(void*));
}

}  // namespace dpde
