// SPDX-License-Identifier: Apache-2.0
// Copies of fields on the whole grid at each rank, for rows of a subgrid that read, or add to, computed positions,
// which may lie anywhere. A gather costs memory and messages of the size of the whole grid.
#pragma once

#include <cstddef>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/communicator.h"
#include "grid/field_pool.h"

namespace dpde {

class WholeFields {
 public:
  /// `count`: number of fields. Both references must outlive the object.
  WholeFields(const dpde_layout& subgrid, Communicator& ranks, std::size_t count);

  const dpde_layout& layout() const { return layout_; }
  /// Pointer to its cell (0, 0, 0).
  void* base(std::size_t number) const { return pool_.base(static_cast<int64_t>(number)); }

  /// Copies the field of all ranks, with its halo at sides of the grid; `field` points at its cell (0, 0, 0).
  void gather(const void* field, std::size_t number);
  void clear(std::size_t number);
  /// Adds to the field the contributions of all ranks since clear(), in the order of the ranks.
  void add(std::size_t number, void* field);

 private:
  template <class F>
  void for_each_own_row(const F& f);

  const dpde_layout* subgrid_;
  Communicator* ranks_;
  dpde_layout layout_{};
  FieldPool pool_;
  std::vector<double> values_;  // of one field, halo included
};

}  // namespace dpde
