// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// The cell counts set for each of `axes` axes: one number for all axes, or one each, cells=64,32.
std::vector<std::optional<double>> cells_setting(Elaboration& elaboration, std::size_t axes);

}  // namespace dpde::model
