// SPDX-License-Identifier: Apache-2.0
// Checks the invariants of model.h on a whole problem.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Violations, one sentence each; empty for every problem that from_ast returns.
std::vector<std::string> verify(const Problem& problem);

}  // namespace dpde::model
