// SPDX-License-Identifier: Apache-2.0
// What Newton's method does in each step, for programs that are run: solves that are not linear get the linear solve
// for the change of their unknowns,
//   F'(x)*dx = b - F(x),
// whose operator is the tangent of the block (stencil::Solve::step).
#pragma once

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// A pass: all solves of the module that have no step yet get one.
stencil::Module with_newton_steps(stencil::Module module);

}  // namespace dpde::adjoint
