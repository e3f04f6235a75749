// SPDX-License-Identifier: Apache-2.0
// What a decision hangs on: the operands of comparisons, of sign, floor and fraction, and the places of interpolations.
// States that are mirror images of each other, as at a wall, make both sides of a comparison equal, and then the last
// bit decides: in a gather the same comparison stands once for each displacement, in programs that were derived it
// stands again. So the value of such an operand is a function of its expression alone: passes leave it as it is
// written, and the loop level rounds each of its operations.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Whether what `e` is goes from one case to another where its operands pass some value.
bool is_decision(const Expr& e);

/// Lets of the kernel that operands of decisions are made of, directly or through other lets.
std::set<std::string> decisive_lets(const Kernel& kernel);

}  // namespace dpde::stencil
