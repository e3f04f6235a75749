// SPDX-License-Identifier: Apache-2.0
// The invariants of model.h, checked on a whole problem.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// What is wrong, one sentence each; empty for every problem that from_ast returns.
std::vector<std::string> verify(const Problem& problem);

}  // namespace dpde::model
