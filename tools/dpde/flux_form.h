// SPDX-License-Identifier: Apache-2.0
// Velocities on faces that carry themselves by central differences, as -advect(u, u): the flux form conserves momentum
// and has smaller errors.
#pragma once

#include <string>

#include "model/model.h"
#include "support/json.h"

namespace dpde::tools {

/// `advective_form` of the result, and the text: what to write instead. Only of velocities that a constraint binds, as
/// both forms are equal where the divergence is 0. Upwind differences and steps along the flow are other methods.
std::string report_flux_form(const model::Problem& problem, Json& result);

}  // namespace dpde::tools
