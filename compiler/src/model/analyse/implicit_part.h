// SPDX-License-Identifier: Apache-2.0
// The terms that implicit time schemes solve for: stiff linear terms, or those that the scheme names. All others are
// explicit.
#pragma once

#include "model/build.h"

namespace dpde::model {

std::string_view name_of(Implicit implicit);

/// The right-hand side `rate` of a state as part + rest. For Implicit::linear, `part` has the terms that are linear in
/// the state, have a second or higher derivative of it, and have neither other states nor an advect; of a term with
/// several summands, k*(lap(u) + v), only the fitting ones. Otherwise `part` has all terms, or those without an advect.
LinearPart implicit_part(const Problem& problem, const std::string& state, const Expr& rate);

/// Whether a mask fixes a field at a value that depends on states, or a mask depends on states. Stages use these states
/// as of the beginning of the step.
bool holds_at_states(const Problem& problem);

}  // namespace dpde::model
