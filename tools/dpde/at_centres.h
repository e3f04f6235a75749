// SPDX-License-Identifier: Apache-2.0
// What lies on faces, at the centres of the cells: for programs that know no staggered values.
#pragma once

#include <vector>

#include "driver/session.h"

namespace dpde::tools {

/// Means of the faces on both sides, of as many states as there are, one after the other, x fastest. Beside a wall that
/// holds no value in the array it is the boundary's where that is a number, else the line through the two next faces.
std::vector<double> at_centres(const driver::Session& session, const std::string& field, std::vector<double> values);

}  // namespace dpde::tools
