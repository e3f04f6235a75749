// SPDX-License-Identifier: Apache-2.0
// Reverse mode of one kernel: a backward walk that gives one contribution per read, then the shift that turns scatters
// into one gather.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "adjoint/reverse/plan.h"

namespace dpde::adjoint {

/// State of the reverse sweep at one run.
struct RunContext {
  const std::vector<Topology>& axes;
  int grow = 0;         // of the primal run
  int target_grow = 0;  // of the adjoint gather
  /// Seed of a varied field at the current point; nullopt if no later statement uses the field.
  std::function<std::optional<stencil::Expr>(const std::string& field)> seed;
  /// True if x_bar of the field has values already, so that contributions add to it.
  std::function<bool(const std::string& field)> is_initialised;
};

struct KernelAdjoint {
  stencil::Kernel shared;                // runs before `gather`, if it has stores: see shared_values.h
  int shared_grow = 0;                   // `grow` of its run
  std::vector<std::string> stored;       // fields of `shared` that `gather` reads
  stencil::Kernel gather;                // may have neither stores nor sums
  stencil::Kernel scatter;               // may have no scatters
  std::vector<std::string> contributed;  // primal fields whose adjoints these kernels write
};

/// The adjoint of `kernel`; `varied` is that of the program, without locals.
KernelAdjoint adjoint_of(const stencil::Kernel& kernel, const Varied& varied, const RunContext& run,
                         DerivedNames& names);

}  // namespace dpde::adjoint
