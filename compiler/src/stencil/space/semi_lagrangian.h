// SPDX-License-Identifier: Apache-2.0
// Semi-Lagrangian transport, split from the other terms. First the time integrator advances every state by the other
// terms to u_mid; then transport computes u_next in one of these ways.
//
// semi_lagrangian: u_mid interpolated at the departure point, one Euler step back from the arrival point, with the
// velocity of the states just advanced. Linear, or cubic along every axis.
//
// maccormack (Selle, Fedkiw, Kim, Liu, Rossignac 2008): u_ahead = A(u_mid) by linear interpolation. The reverse step
// A'(u_ahead) should return u_mid, so half of the difference estimates the error of A:
//   u_next = u_ahead + (u_mid - A'(u_ahead))/2, clamped to the corners of the cell of u_mid that A has read.
// A uses the velocity at t, A' that at t + dt (of the predicted states): order 2 also if the flow varies in time or
// transports itself. Where a displacement leads beyond a wall, A' does not estimate the error of A, and u_next =
// u_ahead.
//
// maccormack(steady): the same with the velocity at the start of the step in both directions, and the correction
// everywhere.
//
// The scheme names the method of each state; transport by differences counts among the other terms. Velocities are
// interpolated to the state's placement.
#pragma once

#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// Reports every state with semi-Lagrangian advect whose equation is not dt(u) = -advect(v, u) + terms without advect.
void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink);

/// The step of a checked problem, or of a part of its terms. The caller adds the projections of constraints.
std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<Advance>& advances);

}  // namespace dpde::stencil
