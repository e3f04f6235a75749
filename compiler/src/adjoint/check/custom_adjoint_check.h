// SPDX-License-Identifier: Apache-2.0
// Checks custom adjoints: each is compared with the derived tangent on a few cells with random values; if it depends on
// the position, on cells of the scene's grid.
#pragma once

#include "adjoint/adjoint.h"
#include "adjoint/rules.h"

namespace dpde::adjoint {

/// An adjoint() that uses custom adjoints without a check.
using Reverse = Derivative (*)(const stencil::Module& module, const std::string& program, const Activity& wrt,
                               DiagnosticSink& sink);

/// False, and an error, if a custom adjoint that the adjoint of `program` uses is not the transpose. The test compares
/// dot products for one interpreted run of the kernel, with periodic axes and with walls; kernels that use coordinates
/// run with the axes of the program, in `surroundings`.
bool check_given(const stencil::Module& module, const stencil::Program& program, const Varied& varied, Reverse reverse,
                 const Surroundings& surroundings, DiagnosticSink& sink);

}  // namespace dpde::adjoint
