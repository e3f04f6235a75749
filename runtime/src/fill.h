// SPDX-License-Identifier: Apache-2.0
// Fills and folds of halos, resolved for one layout. Semantics: compiler/src/stencil/stencil.h.
//
// Halo cells are set outwards, both sides in turn: cell -1-k (or n+k) then only reads an interior cell or a halo cell
// nearer to the interior, which is already set. So every extent n >= 1 and every width is handled by the same loop.
#pragma once

#include <array>
#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

/// The image of `from` in layer `layer` beyond a side (or around a periodic axis) where c is the same all along it.
void set_image(double* to, const double* from, int64_t count, const dpde_side& side, int64_t layer, const double* uniforms);

class HaloFill {
 public:
  HaloFill() = default;
  HaloFill(const dpde_fill& fill, const dpde_layout& layout);

  int field() const { return field_; }
  /// Sets the whole halo. `fields` point at their cells (0,0,0).
  void run(double* const* fields, const double* uniforms) const;
  /// The same for one field, where no values come from fields.
  void run_plain(double* base, const double* uniforms) const;
  /// Only the ends of one row; `row` points at its cell x = 0.
  void run_row(double* row, const double* uniforms) const {
    const Axis& x = axes_[0];
    if (!x.periodic) return run_bounded_row(row, uniforms);
    const int64_t n = x.cells;
    for (int64_t k = 0; k < x.halo; ++k) {
      row[-1 - k] = row[n - 1 - k];
      row[n + k] = row[k];
    }
  }
  /// The rows of the y halo that are images of row y, which is complete with its ends; `row` points at its cell x = 0.
  /// Only when images_are_direct().
  void run_images(double* row, int64_t y, const double* uniforms) const {
    if (y < axes_[1].halo || y >= axes_[1].cells - axes_[1].halo) set_images(row, y, uniforms);
  }
  /// Every row of the y halo is the image of an interior row: not so when the halo is wider than the interior.
  bool images_are_direct() const { return axes_[1].halo <= axes_[1].cells; }
  /// The y halo, when the ends of all interior rows are set.
  void run_y(double* base, const double* uniforms) const;
  /// The z halo, when the y halo is set too.
  void run_z(double* base, const double* uniforms) const;

 private:
  struct Axis {
    bool periodic = true;
    dpde_side low{}, high{};
    int64_t cells = 1, halo = 0;
  };
  void run_walls(double* const* fields, const double* uniforms) const;
  void run_bounded_row(double* row, const double* uniforms) const;
  void set_images(double* row, int64_t y, const double* uniforms) const;
  void fill_plane_y(double* plane, const double* uniforms) const;

  int field_ = 0;
  bool has_walls_ = false;  // values that vary along a wall, from a field: one cell after the other
  std::array<Axis, 3> axes_;
  std::array<int64_t, 3> stride_{};
};

class HaloFold {
 public:
  HaloFold() = default;
  HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout);

  /// `fields` point at their cells (0,0,0).
  void run(double* const* fields, const double* uniforms) const;

 private:
  struct Axis {
    int64_t cells = 1, grow = 0;  // grow 0: nothing to fold
    dpde_side low{}, high{};
  };
  void fold_rows(double* const* fields, const double* uniforms, int axis) const;
  void fold_x(double* const* fields, const double* uniforms, int64_t place) const;

  int field_ = 0;
  std::array<Axis, 3> axes_;
  std::array<int64_t, 3> stride_{};
};

}  // namespace dpde
