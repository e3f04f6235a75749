// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/memory_count.h"

#include <algorithm>

namespace dpde {

void MemoryCount::hold(const std::string& owner, double bytes) {
  held_[owner] += bytes;
  pass(owner, 0);
}

void MemoryCount::hold(const std::vector<OwnedMemory>& owned) {
  for (const OwnedMemory& one : owned) {
    if (!one.shared.empty() && !shared_.insert(one.shared).second) continue;
    making_ = std::max(making_, static_cast<double>(one.making));
    hold(one.owner, static_cast<double>(one.kept));
  }
}

void MemoryCount::pass(const std::string& owner, double bytes) {
  double sum = bytes;
  for (const auto& [name, held] : held_) sum += held;
  if (sum <= peak_) return;
  peak_ = sum;
  shares_ = held_;
  shares_[owner] += bytes;
}

}  // namespace dpde
