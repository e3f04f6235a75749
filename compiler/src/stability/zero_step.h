// SPDX-License-Identifier: Apache-2.0
// The step of a scene with dt = 0: what it makes of the initial states without moving them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::stability {

/// The values of these fields of the step's program at this time; those that are not finite are left out, and all are
/// where a solve does not bear a dt of 0.
std::map<std::string, std::vector<double>> after_step_of_no_length(driver::Session& session,
                                                                   const std::vector<std::string>& fields, double t);

}  // namespace dpde::stability
