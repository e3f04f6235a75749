// SPDX-License-Identifier: Apache-2.0
// Reverse mode of one kernel: a backward walk that leaves one contribution a read, then the shift that turns scatters
// into one gather.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "adjoint/reverse/plan.h"

namespace dpde::adjoint {

/// What the program knows when the walk reaches one run.
struct RunContext {
  const std::vector<Topology>& axes;
  int grow = 0;         // of the primal run
  int target_grow = 0;  // of the adjoint gather
  /// Seed of a varied field at the current point; nullopt when nothing downstream uses the field.
  std::function<std::optional<stencil::Expr>(const std::string& field)> seed;
  /// True if x_bar of the field holds values already, so that contributions add to it.
  std::function<bool(const std::string& field)> is_initialised;
};

struct KernelAdjoint {
  stencil::Kernel shared;                // runs before `gather`, where it has stores: see shared_values.h
  int shared_grow = 0;                   // how far beyond the interior
  std::vector<std::string> stored;       // fields that `gather` reads of it
  stencil::Kernel gather;                // may have neither stores nor sums
  stencil::Kernel scatter;               // may have no scatters
  std::vector<std::string> contributed;  // primal fields whose bars these write
};

/// The adjoint of `kernel`; `varied` is the program's, locals not included.
KernelAdjoint adjoint_of(const stencil::Kernel& kernel, const Varied& varied, const RunContext& run,
                         DerivedNames& names);

}  // namespace dpde::adjoint
