// SPDX-License-Identifier: Apache-2.0
// Differentiation rules: one rule per operator, for both tangent (x = tangent of the child) and adjoint (x = adjoint of
// the node), since both multiply by the same partial derivative.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// x * d(e)/d(child `index` of e) for Neg, Binary and Call nodes.
///
/// Children are numbered as they are written. Conventions at kinks: at a tie max(a,b) takes the derivative of a and
/// min(a,b) that of b, so that max(a,b) + min(a,b) has that of a + b; abs has derivative sign(a), which is 0 at 0;
/// sign, floor, comparisons and conditions have derivative 0, fraction 1. driver/compile/switches.h refuses expressions
/// that jump.
stencil::Expr times_partial(const stencil::Expr& e, int index, const stencil::Expr& x);

/// Names that carry a derivative inside one kernel.
struct Varied {
  std::set<std::string> fields, params, locals;
};

/// True if the value of `e` depends on anything in `varied` in a differentiable way.
bool is_varied(const stencil::Expr& e, const Varied& varied);

/// The varied locals of `kernel`, given its varied fields and params.
std::set<std::string> varied_locals(const stencil::Kernel& kernel, const Varied& outside);

}  // namespace dpde::adjoint
