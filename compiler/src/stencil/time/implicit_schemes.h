// SPDX-License-Identifier: Apache-2.0
// Time schemes that treat the stiff linear terms L u of dt(u) = N(u) + L u (model/analyse/implicit_part.h) implicitly
// and the rest explicitly. A stage has two kernels: the right side R_i, at the time of stage i - 1, and the solve
//   (1 - h*g*L) U_i = R_i,
// at the time of stage i, with its wall values. Ascher, Ruuth and Spiteri, Appl. Numer. Math. 25 (1997) 151:
//   R_i = u + h*(sum of a_ij*N(U_j), j < i) + h*(sum of b_ij*L U_j, 0 < j < i),   g the same in all stages.
// Between stages only U_i and R_i are stored, no rates: h*L U_j = (U_j - R_j)/g, and h*N(U_j) follows from R_(j+1). The
// last stage is the result in all schemes here, so that stiff components are damped. With implicit = all or
// all_but_advect, L is nonlinear, and a stage is solved by Newton's method (stencil/time/newton_stages.h). With all of
// an equation in L, ARS(2,2,2) is the method of Alexander, SIAM J. Numer. Anal. 14 (1977) 1006, and ARS(4,4,3) a
// diagonally implicit one of order 3, both L-stable. imex_euler is ARS(1,1,1), which without N is backward_euler;
// ars222 and ars443 are ARS(2,2,2) and ARS(4,4,3). crank_nicolson allows an N of time and position only and takes the
// mean of both ends of the step.
#pragma once

#include <string>
#include <vector>

#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// One step. Kernels are called NAME_right1, NAME_stage1, NAME_right2, ... If `is_projected`, each stage ends with the
/// projection onto the constraints. `embedded` names fields for the embedded result, which NAME_embedded computes.
std::vector<Stage> implicit_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                                   bool is_projected, const FieldsOfStates& embedded = {});

}  // namespace dpde::stencil
