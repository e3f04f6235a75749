// SPDX-License-Identifier: Apache-2.0
// Multistep schemes, one kernel each:
//  - Adams-Bashforth (weights: model/methods.h). ab2: u + dt (3 F(u) - F_before)/2, where the rate F_before is a state;
//    the first step is an Euler step.
//  - ab3: u + dt (23 F(u) - 16 F_before + 5 F_older)/12. The first step is an Euler step, the second uses
//    2 F(u) - F_before: together they are the midpoint rule over both steps, so that the start contributes an error of
//    dt^3 and the order is 3 from the second step on.
//  - leapfrog: u_before + 2 dt F(u) for an equation of first order, where u_before is a state; the first step is an
//    Euler step. For an equation of second order 2 u - u_before + dt^2 F, in the form v = (u - u_before)/dt,
//    v_next = v + dt F, u_next = u + dt v_next (E. Hairer et al., Acta Numerica 2003, the "one-step formulation on a
//    staggered grid"): less rounding, and u is read only once. v is the velocity half a step earlier, except at the
//    start: the first v_next takes half a step. Damping B v acts on the mean of v and v_next, solved for v_next.
// In schemes of order 2, a first step of order 1 adds a single error of dt^2: the order stays 2.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// Amplification matrix of a step after the starting steps, for dt(u) = (z/dt)*u. Rows and columns are u and the stored
/// values: u, dt*F_before and dt*F_older, or u and u_before. Entries are coefficients of polynomials of z by powers.
/// Empty for one-step schemes; for leapfrog that of an equation of first order.
std::vector<std::vector<std::vector<double>>> multistep_matrix(model::TimeScheme time);

/// The kernel of a checked problem; `advances` has all states, histories with the rate 0.
std::vector<Stage> multistep_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name);

}  // namespace dpde::stencil
