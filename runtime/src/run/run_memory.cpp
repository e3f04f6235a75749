// SPDX-License-Identifier: Apache-2.0
#include "run/run_memory.h"

#include "base/aligned_memory.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/layout.h"

namespace dpde {

FieldPool RunMemory::pool(const dpde_layout& layout, int64_t count, const std::string& folder) {
  if (folder.empty()) bytes_ += allocated_bytes(count * FieldPool::stride_of(layout));
  if (is_plan()) return {};
  FieldPool made(layout, count, folder);
  if (touches_ && folder.empty()) made.touch();
  return made;
}

void RunMemory::add_initial(const dpde_layout& layout, int number) {
  bytes_ += allocated_bytes(field_bytes(layout) + stagger_of(layout, number));
}

}  // namespace dpde
