// SPDX-License-Identifier: Apache-2.0
// Selections between a value and that of a neighbour: limiters, upwind speeds, fluxes between two states. If the
// neighbour is a mirror cell, as at a wall, or the cell itself, both values are equal. Each repetition of the selection
// must then choose the same one.
#pragma once

#include "random/random_expression.h"

namespace dpde::testing {

/// A flux difference or limited slope along one axis, of a field of `scope` and of a value at a point; 0 where nothing
/// can be read that far.
stencil::Expr tie(SplitMix& random, const Scope& scope);

}  // namespace dpde::testing
