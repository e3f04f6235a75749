// SPDX-License-Identifier: Apache-2.0
// Exchanges halos at subdomain interfaces: each rank sends its outermost cells to its neighbours.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/communicator.h"

namespace dpde {

class HaloExchange {
 public:
  /// Allocates everything in advance. Both arguments must outlive the object.
  HaloExchange(const dpde_layout& layout, Communicator& ranks);

  /// Fills the halo at the subdomain interfaces of the axis, over the whole width of the other axes with their halos:
  /// after all axes in turn, corners are right too. `is_ring`: the axis is periodic. Does nothing if the axis is not
  /// divided.
  void run(void* base, std::size_t axis, bool is_ring);
  /// Along all axes, none of them periodic.
  void run(void* base);

  Communicator& ranks() const { return *ranks_; }

 private:
  /// Packs the cells from `first` on, as many along the axis as its halo; returns the bytes.
  std::size_t pack(const void* base, std::size_t axis, int64_t first, std::vector<std::byte>& to) const;
  void unpack(void* base, std::size_t axis, int64_t first, const std::vector<std::byte>& from) const;
  template <class F>
  void for_each_row(std::size_t axis, int64_t first, const F& f) const;

  const dpde_layout* layout_;
  Communicator* ranks_;
  SidesOf<std::vector<std::byte>> to_, from_;
};

}  // namespace dpde
