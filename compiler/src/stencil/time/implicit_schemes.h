// SPDX-License-Identifier: Apache-2.0
// Time schemes that solve for the stiff linear terms L u of dt(u) = N(u) + L u (model/analyse/implicit_part.h) and take
// the rest explicitly. A stage has two kernels: the right side R_i, where stage i - 1 is, and the solve
//   (1 - h*g*L) U_i = R_i,
// where stage i is, with the walls of that time. Ascher, Ruuth and Spiteri, Appl. Numer. Math. 25 (1997) 151:
//   R_i = u + h*(sum of a_ij*N(U_j), j < i) + h*(sum of b_ij*L U_j, 0 < j < i),   g the same in all stages.
// Between stages only U_i and R_i are kept, no rates: h*L U_j = (U_j - R_j)/g, and h*N(U_j) follows from R_(j+1). The
// last stage is the result in all schemes here, so that it damps what is stiff. Where the scheme says implicit = all or
// all_but_advect, L is no longer linear, and a stage is solved by Newton's method (stencil/time/newton_stages.h); with
// all of an equation in L, ARS(2,2,2) is the method of Alexander, SIAM J. Numer. Anal. 14 (1977) 1006, and ARS(4,4,3) a
// diagonally implicit one of order 3, both L-stable. imex_euler is ARS(1,1,1), which is
// backward_euler where there is no N; ars222 and ars443 are ARS(2,2,2) and ARS(4,4,3). crank_nicolson has an N of
// time and place alone and takes the mean of both ends.
#pragma once

#include <string>
#include <vector>

#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// One step. Kernels are called NAME_right1, NAME_stage1, NAME_right2, ... Constraints are made true behind each stage
/// where `is_projected`. `embedded` names fields for the other result of a pair, which NAME_embedded makes.
std::vector<Stage> implicit_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                                   bool is_projected, const FieldsOfStates& embedded = {});

}  // namespace dpde::stencil
