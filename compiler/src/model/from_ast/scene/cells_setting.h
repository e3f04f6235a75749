// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// The cells set for each of so many axes: one number for all of them, or one each, cells=64,32.
std::vector<std::optional<double>> cells_setting(Elaboration& elaboration, std::size_t axes);

}  // namespace dpde::model
