// SPDX-License-Identifier: Apache-2.0
// Fills and folds of halos, resolved for one layout. Semantics: compiler/src/stencil/stencil.h.
//
// Ghost cells are filled outwards, on both sides alternately: cell -1-k (or n+k) then reads only interior cells or
// ghost cells nearer to the interior, which are already filled. So one loop handles every n >= 1 and every width. Axes
// are filled one after the other; threads share the other axes. On a subgrid each axis exchanges its halos at subdomain
// interfaces before the next axis is filled.
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
  /// `exchange`: of a subgrid; must outlive the object. Then only run() may be called.
  HaloFill(const dpde_fill& fill, const dpde_layout& layout, HaloExchange* exchange = nullptr);

  int field() const { return field_; }
  /// Fills the whole halo. `fields` point at their cells (0,0,0).
  void run(void* const* fields, const double* uniforms, const Team& team) const;
  /// The same for one field, if no boundary values come from fields.
  void run_plain(void* base, const double* uniforms, const Team& team) const;
  /// Fills only the two ends of one row; `row` points at its cell x = 0.
  void run_row(void* row, const double* uniforms) const {
    const HaloAxis& x = axes_[0];
    if (!x.periodic) return run_bounded_row(row, uniforms);
    real_ == DPDE_F64 ? wrap_row(static_cast<double*>(row)) : wrap_row(static_cast<float*>(row));
  }
  /// Fills the rows of the y halo whose mirror row is y; the ends of row y must be filled. `row` points at its cell x =
  /// 0. Only if images_are_direct().
  void run_images(void* row, int64_t y, const double* uniforms) const {
    if (y < axes_[1].halo || y >= axes_[1].cells - axes_[1].halo) set_images(row, y, uniforms);
  }
  /// True if boundary values come from a field, or mirror cells lie across a pole: then only run() may be called.
  bool is_of_all() const { return is_of_all_; }
  /// True if every row of the y halo is computed from one interior row; false if the halo is wider than the interior.
  bool images_are_direct() const { return images_are_direct_; }
  /// Fills `count` adjacent values of layer k beyond a side (is_mirrored) of an axis from their mirror cells.
  void set_image(size_t axis, bool is_low, int64_t k, void* to, const void* from, int64_t count,
                 const double* uniforms) const;
  /// Fills the y halo, once the ends of all interior rows are filled.
  void run_y(void* base, const double* uniforms, const Team& team) const;
  /// Fills the z halo, once the y halo is filled too.
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
  /// Fills the z halo of the rows at one y.
  template <class Real>
  void fill_row_z(Real* row, const double* uniforms) const;

  int field_ = 0;
  int32_t real_ = DPDE_F64;
  bool images_are_direct_ = false;
  bool is_of_all_ = false;  // filled cell by cell
  std::array<HaloAxis, 3> axes_;
  std::array<int64_t, 3> stride_{};
  HaloExchange* exchange_ = nullptr;
  std::array<bool, 3> is_ring_{};
  std::vector<int> walls_;  // on a subgrid: fields that hold boundary values
};

/// Nothing is folded at subdomain interfaces: sweeps of a subgrid are not extended there, since those cells are the
/// neighbour's.
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
  std::array<HaloAxis, 3> axes_;  // halo: number of folded cells
  std::array<int64_t, 3> stride_{};
};

}  // namespace dpde
