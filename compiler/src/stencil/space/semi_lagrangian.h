// SPDX-License-Identifier: Apache-2.0
// Transport along the flow, split from the other terms. First the other terms advance every state to u_mid by the time
// integrator; then u_next is what the flow brings, in one of two ways.
//
// semi_lagrangian: u_mid interpolated where the flow comes from, one Euler step back from the arrival point, with the
// velocity of the states just advanced. Linear, or cubic along every axis.
//
// maccormack (Selle, Fedkiw, Kim, Liu, Rossignac 2008): u_ahead = A(u_mid) by linear interpolation; the same step
// backwards, A'(u_ahead), should give u_mid again, so that half of what it misses is the error of A:
//   u_next = u_ahead + (u_mid - A'(u_ahead))/2, clamped to the corners of the cell of u_mid that A has read.
// A goes with the velocity at t, A' with that at t + dt (of the states ahead): of order 2 also where the flow varies in
// time or carries itself. Where one of the ways leads beyond a wall, A' says nothing about A, and u_ahead stays.
//
// maccormack(steady): the same with the velocity where the step begins both ways, and the correction everywhere.
//
// Each state has the way that the scheme says for it; differences, where it says these, are other terms. Velocities are
// interpolated to where the state lies.
#pragma once

#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// Reports every state whose advect follows the flow and whose equation is not dt(u) = -advect(v, u) + terms without
/// advect.
void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink);

/// The step of a checked problem, or of a part of its terms. Constraints are left to whoever asks for it.
std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<Advance>& advances);

}  // namespace dpde::stencil
