// SPDX-License-Identifier: Apache-2.0
// Operands of decisions: the operands of comparisons, of sign, floor and fraction, and the positions of interpolations.
// For states that mirror each other, as at a wall, both sides of a comparison are equal, and the last bit decides. The
// same comparison occurs several times: in a gather once per displacement, and again in derived programs. All must
// decide alike. So the value of such an operand depends on its expression alone: passes keep it as written, and the
// loop level rounds each of its operations.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Whether `e` switches between cases where its operands pass some value.
bool is_decision(const Expr& e);

/// Lets of the kernel on which operands of decisions depend, directly or through other lets.
std::set<std::string> decisive_lets(const Kernel& kernel);

}  // namespace dpde::stencil
