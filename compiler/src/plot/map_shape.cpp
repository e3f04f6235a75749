// SPDX-License-Identifier: Apache-2.0
#include "plot/map_shape.h"

#include <cmath>
#include <numbers>

#include "support/assert.h"
#include "support/names/number_text.h"

namespace dpde::plot {

namespace {

/// At most: of more, a part of the disc would cover another.
bool is_one_turn(const ShownAxis& angle) {
  constexpr double rounding = 1e-6;  // of angles in files
  return std::abs(angle.extent) <= 2 * std::numbers::pi * (1 + rounding);
}

MapShape shape_of(const std::optional<model::CoordinateSystem>& system, const ShownAxis& a, const ShownAxis& b) {
  const MapShape lengths = a.unit == b.unit ? MapShape::to_scale : MapShape::stretched;
  if (!system) return lengths;
  switch (*system) {
    case model::CoordinateSystem::given: return MapShape::stretched;
    case model::CoordinateSystem::cylinder: return lengths;
    case model::CoordinateSystem::sphere: return MapShape::sphere;
    case model::CoordinateSystem::polar:  // r, theta and z
      if (a.number == 0 && b.number == 2) return lengths;
      return a.number == 0 && is_one_turn(b) ? MapShape::polar : MapShape::stretched;
  }
  unreachable("coordinate system");
}

}  // namespace

void set_axes(MapPanel& panel, const std::optional<model::CoordinateSystem>& system, const ShownAxis& a,
              const ShownAxis& b) {
  panel.shape = shape_of(system, a, b);
  const bool is_disc = panel.shape == MapShape::polar, is_sphere = panel.shape == MapShape::sphere;
  const std::string degrees = "\u00b0";
  panel.x.label = dpde::label_of(is_disc ? "x" : a.name, is_sphere ? degrees : a.unit);
  panel.y.label = dpde::label_of(is_disc ? "y" : b.name, is_sphere ? degrees : is_disc ? a.unit : b.unit);
}

}  // namespace dpde::plot
