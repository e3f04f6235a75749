// SPDX-License-Identifier: Apache-2.0
// Transport along characteristics, split from the other terms. First the other terms advance every state to u_mid by
// the time integrator; then u_next is u_mid interpolated where the flow comes from: one Euler step back from
// the arrival point, with the velocity of the states just advanced.
//
// Interpolation is linear, or cubic along periodic axes: with f the place between two cells and d the second difference of
// a cell, linear - f (1 - f)/6 ((2 - f) d_left + (1 + f) d_right) is Lagrange's cubic (Everett's form). Second differences
// are those of the slopes of linear interpolations one cell apart, so that derivatives and scatters are those of Interp;
// the derivative through the place is that of the cubic, at a cell of the one to its right. Along bounded axes it is linear.
#pragma once

#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/lowering.h"

namespace dpde::stencil {

/// Reports every state whose equation is not dt(u) = -advect(v, u) + terms without advect.
void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink);

/// The step of a checked problem; `into` are the fields of the results, one a state.
std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<std::string>& into);

}  // namespace dpde::stencil
