// SPDX-License-Identifier: Apache-2.0
// Derivatives of transforms: v = M(p)*u has v_dot = M*u_dot + (dM/dp)*u*p_dot, u_bar = M^T*v_bar, and p_bar is the sum
// over the cells of v_bar*(dM/dp)*u. They are transforms again: dM/dp of phi_N(a)*f is
// phi_N(a)*(a'*f + f') - N*phi_P(a)*a'*f with P = N+1, that of inverse_N(a)*f is inverse_N(a)*f' - N*inverse_P(a)*a'*f,
// and M^T is M for -k.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"

namespace dpde::adjoint {

/// Whether the result varies, by a field or by a parameter.
bool is_varied(const stencil::Transform& transform, const Varied& varied);

/// Appends the statements that compute the tangent of the result.
void add_tangent_of(const stencil::Transform& transform, const Varied& varied, const Writing& into);

/// Transforms from the seed of the result to the contribution of each varied field. `result` is the primal field's
/// name, which the caller replaces.
std::vector<stencil::Transform> transposes_of(const stencil::Transform& transform, const std::string& seed,
                                              const Varied& varied);

/// For each parameter p a transform, whose result has no name yet: p_bar is the sum over the cells of the seed times
/// this result.
std::vector<std::pair<std::string, stencil::Transform>> slopes_of(const stencil::Transform& transform,
                                                                  const Varied& varied);

}  // namespace dpde::adjoint
