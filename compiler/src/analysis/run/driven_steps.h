// SPDX-License-Identifier: Apache-2.0
// When a run is driven by the time: at which of its steps conditions of t change, and where numbers of t are smallest
// and largest. What is looked at there has met each source that is on for a while.
#pragma once

#include <vector>

#include "model/model.h"

namespace dpde::analysis {

/// Of what steps compute and sides are given, in order; empty where nothing of it depends on t. A combination of
/// conditions changes where one of them does, so each of its values is met right behind such a change.
std::vector<int> driven_steps(const model::Problem& problem);

}  // namespace dpde::analysis
