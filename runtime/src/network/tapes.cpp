// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/tapes.h"

#include <algorithm>
#include <iterator>

namespace dpde {

Tapes::Tapes(int64_t tape_bytes, int64_t count) : bytes_(tape_bytes * count), memory_(bytes_) {
  const auto places = static_cast<size_t>(count);
  free_.reserve(places);
  taken_.reserve(places);
  for (int64_t i = count; i-- > 0;) free_.push_back(memory_.data() + i * tape_bytes);
}

char* Tapes::take() {
  if (free_.empty()) {
    std::rotate(taken_.begin(), taken_.begin() + 1, taken_.end());
    return taken_.back();
  }
  taken_.push_back(free_.back());
  free_.pop_back();
  return taken_.back();
}

void Tapes::release(char* tape) {
  taken_.erase(std::prev(std::find(taken_.rbegin(), taken_.rend(), tape).base()));
  free_.push_back(tape);
}

void Tapes::clear() {
  free_.insert(free_.end(), taken_.rbegin(), taken_.rend());
  taken_.clear();
}

}  // namespace dpde
