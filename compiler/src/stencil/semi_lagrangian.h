// SPDX-License-Identifier: Apache-2.0
// Transport along characteristics, split from the other terms. First the other terms advance every state to u_mid by
// the time integrator; then u_next is u_mid interpolated (linearly) where the flow comes from: one Euler step back from
// the arrival point, with the velocity of the states just advanced.
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
