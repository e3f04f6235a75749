// SPDX-License-Identifier: Apache-2.0
// Time schemes that remember, one kernel each:
//  - Adams-Bashforth (model/methods.h has the weights). ab2: u + dt (3 F(u) - F_before)/2, the rate F_before being a
//    state; the first step is Euler's.
//  - ab3: u + dt (23 F(u) - 16 F_before + 5 F_older)/12. The first step is Euler's, the second takes 2 F(u) - F_before:
//    with the first one that is the midpoint rule over both, so that what is left of the start is an error of dt^3 and
//    the order stays 3 from the second step on.
//  - leapfrog: u_before + 2 dt F(u) for an equation of first order, u_before being a state; the first step is Euler's.
//    For one of second order 2 u - u_before + dt^2 F, in the form v = (u - u_before)/dt, v_next = v + dt F,
//    u_next = u + dt v_next (E. Hairer et al., Acta Numerica 2003, the "one-step formulation on a staggered grid"):
//    less rounding, and u is read but once. v is the velocity half a step before, except at the start: the first v_next
//    takes half a step. Damping B v acts on the mean of v and v_next, which is solved for v_next.
// Of order 2, a first step of order 1 costs one error of dt^2: the order stays 2.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// What a step behind the first ones makes of a state with dt(u) = (z/dt)*u and of what it remembers: of u, dt*F_before
/// and dt*F_older, of u and u_before. A row each, of polynomials of z by powers. Empty of schemes without a memory;
/// leapfrog's is of equations of first order.
std::vector<std::vector<std::vector<double>>> multistep_matrix(model::TimeScheme time);

/// The kernel of a checked problem; `advances` has all states, histories with the rate 0.
std::vector<Stage> multistep_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
