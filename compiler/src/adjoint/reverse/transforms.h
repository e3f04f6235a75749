// SPDX-License-Identifier: Apache-2.0
// Derivatives of transforms: v = M(p)*u has v_dot = M*u_dot + (dM/dp)*u*p_dot, u_bar = M^T*v_bar, and each parameter
// gets the sum over the cells of v_bar*(dM/dp)*u. They are transforms again: dM/dp of phi_N(a)*f is
// phi_N(a)*(a'*f + f') - N*phi_P(a)*a'*f with P = N+1, that of inverse_N(a)*f is inverse_N(a)*f' - N*inverse_P(a)*a'*f,
// and M^T is M for -k.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"

namespace dpde::adjoint {

/// Whether its result varies, by a field or by a parameter.
bool is_varied(const stencil::Transform& transform, const Varied& varied);

/// Appends what makes the rate of its result.
void add_tangent_of(const stencil::Transform& transform, const Varied& varied, const Writing& into);

/// Transforms from the seed of the result to what each varied field gets, whose name stands where the result's will be.
std::vector<stencil::Transform> transposes_of(const stencil::Transform& transform, const std::string& seed,
                                              const Varied& varied);

/// What a parameter gets: the sum over the cells of the seed times the result of the transform, which has no name yet.
std::vector<std::pair<std::string, stencil::Transform>> slopes_of(const stencil::Transform& transform,
                                                                  const Varied& varied);

}  // namespace dpde::adjoint
