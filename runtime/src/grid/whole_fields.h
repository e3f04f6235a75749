// SPDX-License-Identifier: Apache-2.0
// Fields of the whole grid at each rank: what rows of a subgrid read, or add to, at places that are computed and may
// lie anywhere. A gather costs memory and messages of the size of the whole grid.
#pragma once

#include <cstddef>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/communicator.h"
#include "grid/field_pool.h"

namespace dpde {

class WholeFields {
 public:
  /// `count` of them; both must stay.
  WholeFields(const dpde_layout& subgrid, Communicator& ranks, std::size_t count);

  const dpde_layout& layout() const { return layout_; }
  /// Its cell (0, 0, 0).
  void* base(std::size_t number) const { return pool_.base(static_cast<int64_t>(number)); }

  /// Makes it what the field is, whose halo at sides of the grid goes along; `field` points at its cell (0, 0, 0).
  void gather(const void* field, std::size_t number);
  void clear(std::size_t number);
  /// Adds what all ranks have added to it since it was cleared, in their order, to the field.
  void add(std::size_t number, void* field);

 private:
  template <class F>
  void for_each_own_row(const F& f);

  const dpde_layout* subgrid_;
  Communicator* ranks_;
  dpde_layout layout_{};
  FieldPool pool_;
  std::vector<double> values_;  // of one, halo included
};

}  // namespace dpde
