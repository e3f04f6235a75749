// SPDX-License-Identifier: Apache-2.0
// Detects velocities on faces advected by themselves with central differences, as in -advect(u, u): the flux form
// conserves momentum and has smaller errors.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::report {

/// Names of these velocities. Only velocities bound by a constraint count, since the forms are equal for divergence 0.
/// Upwind differences and semi-Lagrangian steps are other methods.
std::vector<std::string> advective_velocities(const model::Problem& problem);
/// The flux form to use instead, one line for each.
std::string flux_form_text(const std::vector<std::string>& velocities);

}  // namespace dpde::report
