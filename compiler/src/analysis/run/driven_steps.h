// SPDX-License-Identifier: Apache-2.0
// Steps of a run at which conditions on t change and functions of t are smallest or largest. Tests at these steps see
// every source that is on for some time.
#pragma once

#include <vector>

#include "model/model.h"

namespace dpde::analysis {

/// Considers formulas of steps and boundary values; sorted, empty if nothing depends on t. A combination of conditions
/// changes only if one of them does, so each of its values occurs right after such a change.
std::vector<int> driven_steps(const model::Problem& problem);

}  // namespace dpde::analysis
