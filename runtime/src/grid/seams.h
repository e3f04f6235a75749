// SPDX-License-Identifier: Apache-2.0
// Communication between the ranks of a divided grid around the operations of a program, planned when its executor is
// made.
//
// Fills exchange halos at subdomain interfaces themselves (fill.h). Sweeps that read across an interface need more: the
// adjoint of a term between walls has no fill, since masks keep its reads inside the grid, but not inside the subgrid.
// So the halo of a field is exchanged before a sweep reads it, unless it is up to date. prepare() updates those of
// inputs.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dpde/kernel_abi.h"
#include "grid/halo_exchange.h"
#include "grid/whole_fields.h"

namespace dpde {

struct SeamWork {
  /// Exchanges the halo of a field; or gathers, clears, or adds back its copy on the whole grid.
  enum class Kind { exchange, gather, clear, add } kind;
  int field;
  std::size_t whole = 0;
};

class Seams {
 public:
  /// All arguments must outlive the object.
  Seams(const dpde_program& program, const dpde_layout& layout, Communicator& ranks);

  /// For the operations of the program in their order: the work before one, and after it.
  std::vector<SeamWork> before(const dpde_operation& operation);
  std::vector<SeamWork> after(const dpde_operation& operation);
  /// Starts a block: the caller has changed the fields, so no halo is up to date.
  void begin_block();

  void run(const SeamWork& work, void* const* fields);
  HaloExchange& exchange() { return exchange_; }
  /// Null if no row reads or adds at computed positions.
  WholeFields* whole() { return whole_ ? &*whole_ : nullptr; }

 private:
  const dpde_kernel& kernel_of(const dpde_operation& sweep) const { return program_->kernels[sweep.kernel]; }
  bool crosses(const dpde_stream& stream) const;
  void note(int field, bool is_current);

  const dpde_program* program_;
  const dpde_layout* layout_;
  HaloExchange exchange_;
  std::optional<WholeFields> whole_;
  std::vector<char> is_current_;  // of each field: its halo at interfaces equals the neighbours' cells
};

}  // namespace dpde
