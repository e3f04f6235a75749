// SPDX-License-Identifier: Apache-2.0
// An adjoint that a person gives is not believed: it is compared with the tangent, which is derived, on a few cells
// with random values; where it depends on the place, on such cells of the scene's grid.
#pragma once

#include "adjoint/adjoint.h"
#include "adjoint/rules.h"

namespace dpde::adjoint {

/// An adjoint() that believes what is given.
using Reverse = Derivative (*)(const stencil::Module& module, const std::string& program, const Activity& wrt,
                               DiagnosticSink& sink);

/// False, and an error, where a formula that the adjoint of `program` takes is not that of the transpose: dot products
/// of one run of the kernel, interpreted, with periodic axes and with walls; what names coordinates, as the program has
/// them in `surroundings`.
bool check_given(const stencil::Module& module, const stencil::Program& program, const Varied& varied, Reverse reverse,
                 const Surroundings& surroundings, DiagnosticSink& sink);

}  // namespace dpde::adjoint
