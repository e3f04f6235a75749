// SPDX-License-Identifier: Apache-2.0
// The matrix of a linear operator that is a list of operations: what it makes of unit vectors, those of many cells at
// once that are too far apart to meet (colours, Curtis, Powell and Reid 1974).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "solve/stencil_matrix.h"

namespace dpde {

/// Makes the image of interior values, x fastest.
using LinearImage = std::function<void(std::span<const double> values, std::span<double> image)>;

/// `reach`: how far from a cell its image looks, -1: anywhere. `rounding`: relative error of values.
/// \throws dpde::Error where the operator is not linear or reaches farther. `what`: its name in messages.
StencilMatrix probe(const LinearImage& image, const std::array<std::int64_t, 3>& cells,
                    const std::array<bool, 3>& periodic, const std::array<std::int64_t, 3>& reach, double rounding,
                    const std::string& what);

}  // namespace dpde
