// SPDX-License-Identifier: Apache-2.0
// Velocities on faces that carry themselves by central differences, as -advect(u, u): the flux form conserves momentum
// and has smaller errors.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::report {

/// Their names. Only velocities that a constraint binds, as both forms are equal where the divergence is 0. Upwind
/// differences and steps along the flow are other methods.
std::vector<std::string> advective_velocities(const model::Problem& problem);
/// What to write instead, a line each.
std::string flux_form_text(const std::vector<std::string>& velocities);

}  // namespace dpde::report
