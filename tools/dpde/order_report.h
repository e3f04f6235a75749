// SPDX-License-Identifier: Apache-2.0
// The formal order of a scene's step, walls included, and of the operators of its file.
#pragma once

#include <string>

#include "model/model.h"
#include "support/json.h"

namespace dpde::tools {

/// `order` and `operators` of the result, and the text.
std::string report_order(const model::Problem& problem, Json& result);

}  // namespace dpde::tools
