// SPDX-License-Identifier: Apache-2.0
// The formal order of a scene's step, walls included, and of the operators of its file.
#pragma once

#include <string>

#include "command.h"
#include "driver/jumps.h"
#include "model/model.h"
#include "support/json.h"

namespace dpde::tools {

/// `order` and `operators` of the result, and the text. `jumps`: what lowers it, where that is known.
std::string report_order(const model::Problem& problem, Json& result, const std::vector<driver::Jump>& jumps = {});
/// That the order is 1 there, and what to write.
void warn_of_jumps(Job& job, const std::vector<driver::Jump>& jumps);

}  // namespace dpde::tools
