// SPDX-License-Identifier: Apache-2.0
// Which vectors of a problem are velocities of flows: pictures show their vorticity.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Names of vectors on two axes in coordinates that are lengths, which a constraint corrects or which advect
/// themselves.
std::vector<std::string> flows_in_plane(const Problem& problem);

}  // namespace dpde::model
