// SPDX-License-Identifier: Apache-2.0
// How planes of curved coordinates are drawn.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "model/model.h"
#include "plot/picture.h"

namespace dpde::plot {

/// An axis of a scene: its number and name, its unit, "" if unknown, and the distance of its ends.
struct ShownAxis {
  std::size_t number = 0;
  std::string name, unit;
  double extent = 0;
};
/// Sets the shape and the labels of a map over two axes; x and y of a disc, degrees of a sphere. `system`: nullopt if
/// coordinates are lengths.
void set_axes(MapPanel& panel, const std::optional<model::CoordinateSystem>& system, const ShownAxis& a,
              const ShownAxis& b);

}  // namespace dpde::plot
