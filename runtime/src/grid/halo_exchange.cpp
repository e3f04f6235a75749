// SPDX-License-Identifier: Apache-2.0
#include "grid/halo_exchange.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "dpde/runtime/layout.h"

namespace dpde {

HaloExchange::HaloExchange(const dpde_layout& layout, Communicator& ranks) : layout_(&layout), ranks_(&ranks) {
  int64_t most = 0, all = 1;
  for (size_t a = 0; a < 3; ++a) all *= layout.cells[a] + 2 * layout.halo[a];
  for (size_t a = 0; a < 3; ++a) {
    if (is_divided(layout, a)) most = std::max(most, all / (layout.cells[a] + 2 * layout.halo[a]) * layout.halo[a]);
  }
  for (std::vector<std::byte>* slab : {&to_.low, &to_.high, &from_.low, &from_.high})
    slab->resize(static_cast<size_t>(most * real_bytes(layout)));
}

/// Calls f(element, cells) for each row of a slab.
template <class F>
void HaloExchange::for_each_row(size_t axis, int64_t first, const F& f) const {
  std::array<int64_t, 3> from{}, to{};
  for (size_t a = 0; a < 3; ++a) {
    from[a] = a == axis ? first : -layout_->halo[a];
    to[a] = a == axis ? first + layout_->halo[a] : layout_->cells[a] + layout_->halo[a];
  }
  for (int64_t z = from[2]; z < to[2]; ++z) {
    for (int64_t y = from[1]; y < to[1]; ++y) f(index_of(*layout_, from[0], y, z), to[0] - from[0]);
  }
}

size_t HaloExchange::pack(const void* base, size_t axis, int64_t first, std::vector<std::byte>& to) const {
  const int64_t width = real_bytes(*layout_);
  std::byte* next = to.data();
  for_each_row(axis, first, [&](int64_t element, int64_t cells) {
    std::memcpy(next, static_cast<const std::byte*>(base) + element * width, static_cast<size_t>(cells * width));
    next += cells * width;
  });
  return static_cast<size_t>(next - to.data());
}

void HaloExchange::unpack(void* base, size_t axis, int64_t first, const std::vector<std::byte>& from) const {
  const int64_t width = real_bytes(*layout_);
  const std::byte* next = from.data();
  for_each_row(axis, first, [&](int64_t element, int64_t cells) {
    std::memcpy(static_cast<std::byte*>(base) + element * width, next, static_cast<size_t>(cells * width));
    next += cells * width;
  });
}

void HaloExchange::run(void* base, size_t axis, bool is_ring) {
  const int64_t cells = layout_->cells[axis], halo = layout_->halo[axis];
  if (halo == 0 || !is_divided(*layout_, axis)) return;
  const bool has_low = is_ring || has_low_seam(*layout_, axis), has_high = is_ring || has_high_seam(*layout_, axis);
  const size_t low = has_low ? pack(base, axis, 0, to_.low) : 0;
  const size_t high = has_high ? pack(base, axis, cells - halo, to_.high) : 0;
  ranks_->exchange(axis, {{to_.low.data(), low}, {to_.high.data(), high}},
                   {{from_.low.data(), low}, {from_.high.data(), high}});
  if (has_low) unpack(base, axis, -halo, from_.low);
  if (has_high) unpack(base, axis, cells, from_.high);
}

void HaloExchange::run(void* base) {
  for (size_t axis = 0; axis < 3; ++axis) run(base, axis, false);
}

}  // namespace dpde
