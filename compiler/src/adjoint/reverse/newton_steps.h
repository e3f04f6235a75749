// SPDX-License-Identifier: Apache-2.0
// The steps of Newton's method, for programs that are run: a nonlinear solve gets the linear solve for the change of
// its unknowns,
//   F'(x)*dx = b - F(x),
// whose operator is the tangent of the block (stencil::Solve::step).
#pragma once

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// A pass: gives each nonlinear solve of the module a step, unless it has one.
stencil::Module with_newton_steps(stencil::Module module);

}  // namespace dpde::adjoint
