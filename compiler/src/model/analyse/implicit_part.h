// SPDX-License-Identifier: Apache-2.0
// What implicit time schemes solve for: the terms of an equation that are stiff and linear, or what the scheme says.
// The rest is explicit.
#pragma once

#include "model/build.h"

namespace dpde::model {

std::string_view name_of(Implicit implicit);

/// `rate` of a state as part + rest. Of Implicit::linear the terms with a second or higher derivative of the state are
/// in the part that are linear in it and hold neither other states nor an advect; of a term that has more in it,
/// k*(lap(u) + v), its share. Else all terms, or those without an advect.
LinearPart implicit_part(const Problem& problem, const std::string& state, const Expr& rate);

/// Whether a mask holds a field at what others are, or where they say: stages see these as the step begins.
bool holds_at_states(const Problem& problem);

}  // namespace dpde::model
