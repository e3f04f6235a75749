// SPDX-License-Identifier: Apache-2.0
// The halo cells along one axis, resolved for one layout: where each is, which cells it is made from and how. What a
// condition at a side means is its rule (dpde_rule, made by the compiler); nothing here knows kinds of conditions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"

namespace dpde {

/// What a place gets: weight*image + farther*behind + rate*c. In single precision these factors are rounded once.
struct Ghost {
  double weight = 1, farther = 0, rate = 0;
};

/// The cells of one side in one layer, outwards from 0; `image`, and `behind` one cell farther inside, are set before.
class HaloLayer {
 public:
  /// Around a periodic axis.
  HaloLayer(int64_t place_along, int64_t image_along) : place(place_along), image(image_along), behind(image_along) {}
  /// `cells` along the axis; `global` ones in the whole grid.
  HaloLayer(const dpde_side& side, int64_t cells, int64_t global, bool is_low, int64_t layer);

  int64_t place, image, behind;  // cells along the axis

  /// It is the image and nothing else.
  bool copies() const { return copies_; }
  /// Where the weights are numbers, they are known before any uniforms are.
  Ghost ghost(const double* uniforms) const { return is_number_ ? ghost_ : computed(uniforms); }
  /// c, where no field holds it.
  double value(const double* uniforms) const { return value_ < 0 ? 0.0 : uniforms[value_]; }
  /// The field that holds c, -1 where there is none.
  int field() const { return field_; }
  /// Else what is there stays.
  bool is_made() const { return is_made_; }
  bool reads_inside() const { return reads_image_ || reads_behind_; }
  bool reads_behind() const { return reads_behind_; }
  /// At a pole: image and behind lie half a turn away.
  bool turns() const { return turns_; }

 private:
  Ghost computed(const double* uniforms) const;

  const dpde_ghost_row* row_ = nullptr;
  double way_ = 0;
  int coefficients_[DPDE_SIDE_COEFFICIENTS] = {};
  int value_ = -1, field_ = -1;
  bool is_number_ = true, is_made_ = true, copies_ = true, reads_image_ = true, reads_behind_ = false, turns_ = false;
  Ghost ghost_;
};

/// The axis that runs around the poles of `axis`, and the place half a turn away on it.
constexpr size_t axis_around_pole(size_t axis) { return axis == 0 ? 1 : 0; }
constexpr int64_t half_a_turn_from(int64_t place, int64_t cells) {
  return ((place + cells / 2) % cells + cells) % cells;
}

struct HaloAxis {
  HaloAxis() = default;
  /// At seams there are no layers: what lies there is the neighbour's.
  /// @throws Error(input) where a layer is made from cells that the subgrid does not have.
  HaloAxis(const dpde_boundary& boundary, const dpde_layout& layout, std::size_t axis, int64_t width);

  bool periodic = true;  // and whole: its own cells lie beyond its ends
  int64_t cells = 1, halo = 0;
  std::vector<HaloLayer> layers;  // in the order of a fill; a fold takes them the other way round

  /// Layer k beyond a side, of a field with no points on the walls.
  const HaloLayer& beyond(bool is_low, int64_t k) const {
    return layers[static_cast<size_t>(2 * k + (is_low ? 0 : 1))];
  }
  /// Each layer is beyond the cells and made from one of them.
  bool images_are_direct() const;
};

/// Whether each halo cell follows from its mirror image and numbers that are the same all along the side: blocks of
/// steps have no more at hand.
bool is_mirrored(const dpde_side& side);
bool is_pole(const dpde_side& side);

}  // namespace dpde
