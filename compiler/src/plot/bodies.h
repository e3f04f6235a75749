// SPDX-License-Identifier: Apache-2.0
// Outlines of the bodies of a scene: masks inside of which it gives values to fields.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "model/model.h"
#include "plot/picture.h"

namespace dpde::plot {

/// Two axes of a scene; on three axes also the one that is cut in the middle.
struct Plane {
  std::size_t a = 0, b = 1;
  std::optional<std::size_t> across = {};
};

/// The faces between cells inside and outside of each body, at this time. Bodies whose condition is not a formula of
/// numbers, parameters, coordinates and t are left out, and masks from files.
std::vector<Polyline> outlines(const model::Problem& problem, const std::vector<model::Axis>& axes, const Plane& plane,
                               double time);

}  // namespace dpde::plot
