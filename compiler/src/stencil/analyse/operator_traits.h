// SPDX-License-Identifier: Apache-2.0
// Properties of the operator A of a solve that hold for all values of its coefficients. They are tested on a few cells
// of about unit length, where all terms have similar size, by the interpreter in f64. There a sum that is not
// identically 0 vanishes for arbitrary coefficients only by chance (Schwartz 1980, Zippel 1979), and one that is
// identically 0 leaves rounding errors of 1e-13 of its terms. The cells of a scene do not allow such a test:
// lap(p) - k*p on 1024^2 cells in f32 has diagonals of 4e6, in which k is resolved to 0.25.
#pragma once

#include "stencil/interpret/interpret.h"
#include "stencil/stencil.h"

namespace dpde::stencil {

/// Traits of a linear solve, whose fills may be placed or not; `known`: parameters with fixed values. Decisions
/// (stencil/space/comparisons.h) are tested for values near 1 only.
OperatorTraits traits_of(const Module& module, const Program& program, const Solve& solve, const Params& known = {});

/// The traits that hold for all values on all grids. Returns none for an operator with several unknowns, with decisions
/// or with unlimited reads, or if other terms may hide one: exp(-1000*(x - 0.2)^2) is 0 on cells of length 1.
OperatorTraits certain_traits_of(const Module& module, const Program& program, const Solve& solve);

}  // namespace dpde::stencil
