// SPDX-License-Identifier: Apache-2.0
// The ghost cells along one axis, resolved for one layout: their indices, the cells they are computed from, and the
// coefficients. The compiler translates each boundary condition to a rule (dpde_rule); this code knows only rules.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"

namespace dpde {

/// A ghost value: weight*mirror + second_weight*second + rate*c. In single precision the factors are rounded once.
struct Ghost {
  double weight = 1, second_weight = 0, rate = 0;
};

/// The ghost cells of one side in layer 0, 1, ..., outwards; `mirror`, and `second` one cell farther inside, are filled
/// before.
class HaloLayer {
 public:
  /// For a periodic axis.
  HaloLayer(int64_t place_along, int64_t mirror_along)
      : place(place_along), mirror(mirror_along), second(mirror_along) {}
  /// `cells` along the axis of this subgrid, `global` of the whole grid.
  HaloLayer(const dpde_side& side, int64_t cells, int64_t global, bool is_low, int64_t layer);

  int64_t place, mirror, second;  // cells along the axis

  /// The ghost value is a copy of the mirror.
  bool copies() const { return copies_; }
  /// Constant coefficients are computed in advance.
  Ghost ghost(const double* uniforms) const { return is_number_ ? ghost_ : computed(uniforms); }
  /// c, if no field holds it.
  double value(const double* uniforms) const { return value_ < 0 ? 0.0 : uniforms[value_]; }
  /// The field that holds c, or -1.
  int field() const { return field_; }
  /// False: the cells are not changed.
  bool is_made() const { return is_made_; }
  bool reads_inside() const { return reads_mirror_ || reads_second_; }
  bool reads_second() const { return reads_second_; }
  /// At a pole: mirror and second lie half a turn away.
  bool turns() const { return turns_; }

 private:
  Ghost computed(const double* uniforms) const;

  const dpde_ghost_row* row_ = nullptr;
  double way_ = 0;
  int coefficients_[DPDE_SIDE_COEFFICIENTS] = {};
  int value_ = -1, field_ = -1;
  bool is_number_ = true, is_made_ = true, copies_ = true, reads_mirror_ = true, reads_second_ = false, turns_ = false;
  Ghost ghost_;
};

/// The axis that runs around the poles of `axis`, and the index half a turn away on it.
constexpr size_t axis_around_pole(size_t axis) { return axis == 0 ? 1 : 0; }
constexpr int64_t half_a_turn_from(int64_t place, int64_t cells) {
  return ((place + cells / 2) % cells + cells) % cells;
}

struct HaloAxis {
  HaloAxis() = default;
  /// Subdomain interfaces have no layers: their halo is the neighbour's.
  /// @throws Error(input) if a layer is computed from cells that the subgrid does not have.
  HaloAxis(const dpde_boundary& boundary, const dpde_layout& layout, std::size_t axis, int64_t width);

  bool periodic = true;  // periodic and not divided: wraps to its own cells
  int64_t cells = 1, halo = 0;
  std::vector<HaloLayer> layers;  // in the order of a fill; a fold uses the reverse order

  /// Layer k beyond a side, for a field without points on the walls.
  const HaloLayer& beyond(bool is_low, int64_t k) const {
    return layers[static_cast<size_t>(2 * k + (is_low ? 0 : 1))];
  }
  /// Each layer lies beyond the interior and is computed from one interior cell.
  bool images_are_direct() const;
};

/// Whether each ghost cell depends only on its mirror cell and on numbers that are constant along the side: temporal
/// blocking supports no more.
bool is_mirrored(const dpde_side& side);
bool is_pole(const dpde_side& side);

}  // namespace dpde
