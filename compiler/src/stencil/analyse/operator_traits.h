// SPDX-License-Identifier: Apache-2.0
// What the operator A of a solve is whatever the values of its coefficients are: seen on a few cells that are about one
// unit long, where all terms are of one size, by the interpreter, in f64. There a sum that is not 0 for arbitrary
// coefficients is so by chance alone (Schwartz 1980, Zippel 1979), and what rounding leaves of one that is 0 is 1e-13
// of it. On the cells of a scene nothing of the kind can be seen: lap(p) - k*p on 1024^2 cells in f32 has diagonals of
// 4e6 that hold k to 0.25.
#pragma once

#include "stencil/interpret/interpret.h"
#include "stencil/stencil.h"

namespace dpde::stencil {

/// Of a linear solve, whose fills may be placed or not; `known`: parameters that are not arbitrary. What hangs on a
/// decision (stencil/space/comparisons.h) is seen for values near 1 only.
OperatorTraits traits_of(const Module& module, const Program& program, const Solve& solve, const Params& known = {});

/// Those that hold for all values on all grids. None of an operator for several unknowns, or one that makes decisions
/// or looks anywhere; nor where a term may be hidden by those beside it: exp(-1000*(x - 0.2)^2) is 0 on cells of
/// length 1.
OperatorTraits certain_traits_of(const Module& module, const Program& program, const Solve& solve);

}  // namespace dpde::stencil
