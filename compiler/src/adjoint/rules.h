// SPDX-License-Identifier: Apache-2.0
// Differentiation rules: one rule per operator, for both tangent (x = tangent of the child) and adjoint (x = adjoint of
// the node), since both multiply by the same partial derivative.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// x * d(e)/d(child `index` of e) for Neg, Binary and Call nodes, by the table of support/maths/derivatives.h, whose
/// conventions at kinks hold. Children are numbered as they are written. Jumps are refused by
/// driver/compile/switches.h.
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
