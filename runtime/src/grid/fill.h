// SPDX-License-Identifier: Apache-2.0
// Fills and folds of halos, resolved for one layout. Semantics: compiler/src/stencil/stencil.h.
//
// Halo cells are set outwards, both sides in turn: cell -1-k (or n+k) then only reads an interior cell or a halo cell
// nearer to the interior, which is already set. So every extent n >= 1 and every width is handled by the same loop.
// Axis by axis, threads share what lies along the other axes. Of a subgrid what lies at seams comes from the neighbours
// when an axis is done, before the next one is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"
#include "grid/halo_axis.h"
#include "grid/halo_exchange.h"
#include "grid/real.h"

namespace dpde {

class HaloFill {
 public:
  HaloFill() = default;
  /// `exchange`: of a subgrid; it must stay. There, too, is run() only.
  HaloFill(const dpde_fill& fill, const dpde_layout& layout, HaloExchange* exchange = nullptr);

  int field() const { return field_; }
  /// Sets the whole halo. `fields` point at their cells (0,0,0).
  void run(void* const* fields, const double* uniforms, const Team& team) const;
  /// The same for one field, where no values come from fields.
  void run_plain(void* base, const double* uniforms, const Team& team) const;
  /// Only the ends of one row; `row` points at its cell x = 0.
  void run_row(void* row, const double* uniforms) const {
    const HaloAxis& x = axes_[0];
    if (!x.periodic) return run_bounded_row(row, uniforms);
    real_ == DPDE_F64 ? wrap_row(static_cast<double*>(row)) : wrap_row(static_cast<float*>(row));
  }
  /// The rows of the y halo that are images of row y, which is complete with its ends; `row` points at its cell x = 0.
  /// Only when images_are_direct().
  void run_images(void* row, int64_t y, const double* uniforms) const {
    if (y < axes_[1].halo || y >= axes_[1].cells - axes_[1].halo) set_images(row, y, uniforms);
  }
  /// Where values beyond a wall come from a field, or from half a turn away: then there is run() only.
  bool is_of_all() const { return is_of_all_; }
  /// Every row of the y halo is the image of one interior row: not so when the halo is wider than the interior.
  bool images_are_direct() const { return images_are_direct_; }
  /// Layer k beyond a side (is_mirrored) of an axis, `count` values beside one another, from their images.
  void set_image(size_t axis, bool is_low, int64_t k, void* to, const void* from, int64_t count,
                 const double* uniforms) const;
  /// The y halo, when the ends of all interior rows are set.
  void run_y(void* base, const double* uniforms, const Team& team) const;
  /// The z halo, when the y halo is set too.
  void run_z(void* base, const double* uniforms, const Team& team) const;

 private:
  /// Inlined: on short rows the call would cost as much as the ends.
  template <class Real>
  [[gnu::always_inline]] void wrap_row(Real* values) const {
    const int64_t n = axes_[0].cells;
    for (int64_t k = 0; k < axes_[0].halo; ++k) {
      values[-1 - k] = values[n - 1 - k];
      values[n + k] = values[k];
    }
  }
  template <class Real>
  void run_cells(void* const* fields, const double* uniforms) const;
  void meet(void* base, std::size_t axis) const {
    if (exchange_ != nullptr) exchange_->run(base, axis, is_ring_[axis]);
  }
  void run_bounded_row(void* row, const double* uniforms) const;
  void set_images(void* row, int64_t y, const double* uniforms) const;
  template <class Real>
  void fill_plane_y(Real* plane, const double* uniforms) const;
  /// Of the rows at one y.
  template <class Real>
  void fill_row_z(Real* row, const double* uniforms) const;

  int field_ = 0;
  int32_t real_ = DPDE_F64;
  bool images_are_direct_ = false;
  bool is_of_all_ = false;  // one cell after the other
  std::array<HaloAxis, 3> axes_;
  std::array<int64_t, 3> stride_{};
  HaloExchange* exchange_ = nullptr;
  std::array<bool, 3> is_ring_{};
  std::vector<int> walls_;  // of a subgrid: fields that hold values beyond walls
};

/// At seams nothing is folded: sweeps of a subgrid are not grown there, as those cells are the neighbour's.
class HaloFold {
 public:
  HaloFold() = default;
  HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout);

  /// `fields` point at their cells (0,0,0).
  void run(void* const* fields, const double* uniforms) const;

 private:
  bool folds(std::size_t axis) const { return !axes_[axis].periodic && !axes_[axis].layers.empty(); }
  template <class Real>
  void fold(void* const* fields, const double* uniforms) const;
  template <class Real>
  void fold_rows(void* const* fields, const double* uniforms, int axis) const;
  template <class Real>
  void fold_x(void* const* fields, const double* uniforms, int64_t place) const;
  template <class Real>
  void fold_x_at_pole(void* const* fields, const double* uniforms, int64_t z) const;

  int field_ = 0;
  int32_t real_ = DPDE_F64;
  std::array<HaloAxis, 3> axes_;  // halo: how many cells are folded
  std::array<int64_t, 3> stride_{};
};

}  // namespace dpde
