// SPDX-License-Identifier: Apache-2.0
// Time schemes that treat the linear part of each equation exactly (S. M. Cox and P. C. Matthews, J. Comput. Phys. 176,
// 2002, 430): dt(u) = L*u + N(u), with L a polynomial of wave numbers whose coefficients are uniform and do not depend
// on time. With E = exp(h*L), e = exp(h*L/2), q = h/2*phi_1(h*L/2) and phi_n at h*L:
//   etdrk2, (20) to (22): a = E*u + h*phi_1*N(u),  u' = a + h*phi_2*(N(a) - N(u))
//   etdrk4, (26) to (29): a = e*u + q*N(u),  b = e*u + q*N(a),  c = e*a + q*(2*N(b) - N(u)),
//     u' = E*u + h*((phi_1 - 3*phi_2 + 4*phi_3)*N(u) + (2*phi_2 - 4*phi_3)*(N(a) + N(b)) + (4*phi_3 - phi_2)*N(c))
// L is the sum of the terms in derivatives of the state itself, and in the state; all other terms, with other states
// too, are N. For a wave of two cells L has the values of derivatives at cell centres, where those of odd order are 0:
// the mean over k and -k of functions of L would damp the wave.
#pragma once

#include <string>
#include <vector>

#include "stencil/lower/lowering.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

/// One step: kernels for N, called PREFIX_stage1 ..., and transforms.
std::vector<Stage> exponential_stages(Lowering& lowering, const std::vector<Advance>& advances,
                                      const std::string& prefix);

/// The same stages, with each new value of a state truncated to waves of more than three cells along each axis:
/// products of two such states are not aliased onto the retained waves (S. A. Orszag, J. Atmos. Sci. 28, 1971, 1074).
std::vector<Stage> cut_to_two_thirds(Lowering& lowering, std::vector<Stage> stages);

}  // namespace dpde::stencil
