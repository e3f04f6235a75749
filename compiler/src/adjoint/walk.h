// SPDX-License-Identifier: Apache-2.0
// The backward walk of a kernel: from seeds of its results to one expression, at the same point, for each read, param
// and interp.
#pragma once

#include <vector>

#include "adjoint/reverse/adjoint_kernel.h"
#include "adjoint/shared_values.h"

namespace dpde::adjoint {

struct WalkedBack {
  PointTerms terms;                        // with the lets of the kernel, then those of adjoints
  std::vector<stencil::Scatter> scatters;  // target.field is the primal field
};
WalkedBack walk_back(const stencil::Kernel& kernel, const Varied& varied, const RunContext& run, DerivedNames& names);

}  // namespace dpde::adjoint
