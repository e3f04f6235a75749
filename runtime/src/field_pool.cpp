// SPDX-License-Identifier: Apache-2.0
// Memory of many fields of one layout, also in a file.
#include <fmt/format.h>

#include <cstdlib>

#include "aligned_memory.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "rollout_impl.h"

namespace dpde {

void FieldPool::Free::operator()(char* memory) const {
  if (mapped > 0) {
    unmap_file(memory, mapped);
  } else {
    std::free(memory);
  }
}

int64_t FieldPool::stride_of(const dpde_layout& layout) {
  const int64_t bytes = field_bytes(layout);
  if (bytes < page_bytes) return (bytes + line_bytes - 1) / line_bytes * line_bytes;
  return (bytes + page_bytes - 1) / page_bytes * page_bytes +
         5 * line_bytes;  // neighbours differ by 320 bytes modulo 4 KiB
}

FieldPool::FieldPool(const dpde_layout& layout, int64_t count, const std::string& folder)
    : stride_(stride_of(layout)), origin_(layout.origin * real_bytes(layout)) {
  int64_t bytes = 0;
  if (__builtin_mul_overflow(stride_, count, &bytes) || bytes > (int64_t{1} << 62)) {
    throw Error(ErrorKind::machine,
                fmt::format("there is no memory for {} fields of {} bytes", count, field_bytes(layout)));
  }
  if (count == 0) return;
  memory_ = std::unique_ptr<char, Free>(folder.empty() ? allocate_bytes(bytes) : map_file(folder, bytes),
                                        Free(folder.empty() ? 0 : bytes));
}

}  // namespace dpde
