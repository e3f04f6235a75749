// SPDX-License-Identifier: Apache-2.0
// What the ranks of a divided grid do around the operations of a program, decided when its executor is made.
//
// Fills exchange halos at seams themselves (fill.h). Sweeps that read across a seam need more: the adjoint of what lies
// between walls has no fill, as masks keep its reads inside of the grid, but not of the subgrid. So the halo of a field
// is exchanged before a sweep reads it, unless it is the neighbours' already; inputs that are prepared come with it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dpde/kernel_abi.h"
#include "grid/halo_exchange.h"
#include "grid/whole_fields.h"

namespace dpde {

struct SeamWork {
  /// Of the halo of a field; of its whole field: made what it is, made 0, added to it.
  enum class Kind { exchange, gather, clear, add } kind;
  int field;
  std::size_t whole = 0;
};

class Seams {
 public:
  /// All must stay.
  Seams(const dpde_program& program, const dpde_layout& layout, Communicator& ranks);

  /// For the operations of the program in their order: what is done before one, and after it.
  std::vector<SeamWork> before(const dpde_operation& operation);
  std::vector<SeamWork> after(const dpde_operation& operation);
  /// A block begins with fields that others have changed.
  void begin_block();

  void run(const SeamWork& work, void* const* fields);
  HaloExchange& exchange() { return exchange_; }
  /// Null where no row computes places.
  WholeFields* whole() { return whole_ ? &*whole_ : nullptr; }

 private:
  const dpde_kernel& kernel_of(const dpde_operation& sweep) const { return program_->kernels[sweep.kernel]; }
  bool crosses(const dpde_stream& stream) const;
  void note(int field, bool is_current);

  const dpde_program* program_;
  const dpde_layout* layout_;
  HaloExchange exchange_;
  std::optional<WholeFields> whole_;
  std::vector<char> is_current_;  // of each field: its halo at seams is the neighbours'
};

}  // namespace dpde
