// SPDX-License-Identifier: Apache-2.0
// Halos at the seams of a subgrid: what lies there is the neighbours', who send their outermost cells.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/communicator.h"

namespace dpde {

class HaloExchange {
 public:
  /// Nothing is allocated later. Both must stay.
  HaloExchange(const dpde_layout& layout, Communicator& ranks);

  /// Sets the halo at the seams of the axis, all along the other ones, their halos included: axis after axis corners
  /// are right, too. `is_ring`: the ends of the axis meet. Does nothing along an axis that is not divided.
  void run(void* base, std::size_t axis, bool is_ring);
  /// Along all axes, none of them a ring.
  void run(void* base);

  Communicator& ranks() const { return *ranks_; }

 private:
  /// Bytes of cells from `first` on, as many along the axis as its halo.
  std::size_t pack(const void* base, std::size_t axis, int64_t first, std::vector<std::byte>& to) const;
  void unpack(void* base, std::size_t axis, int64_t first, const std::vector<std::byte>& from) const;
  template <class F>
  void for_each_row(std::size_t axis, int64_t first, const F& f) const;

  const dpde_layout* layout_;
  Communicator* ranks_;
  SidesOf<std::vector<std::byte>> to_, from_;
};

}  // namespace dpde
