// SPDX-License-Identifier: Apache-2.0
// Fills and folds: whole rows along y and z, single cells along x.
#include "fill.h"

#include <algorithm>

namespace dpde {
namespace {

double value_of(int uniform, const double* uniforms) { return uniform < 0 ? 0.0 : uniforms[uniform]; }

/// to = from, or its mirror image about `value`.
void set_row(double* to, const double* from, int64_t count, bool is_value, double value) {
  if (!is_value) {
    std::copy_n(from, count, to);
    return;
  }
  for (int64_t x = 0; x < count; ++x) to[x] = 2 * value - from[x];
}

/// Adds weight * halo onto `to` and clears the halo.
void fold_row(double* to, double* halo, int64_t count, double weight) {
  for (int64_t x = 0; x < count; ++x) {
    to[x] += weight * halo[x];
    halo[x] = 0;
  }
}

}  // namespace

HaloFill::HaloFill(const dpde_fill& fill, const dpde_layout& layout) : field_(fill.field) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    stride_[a] = layout.stride[a];
    axes_[a].cells = layout.cells[a];
    axes_[a].halo = layout.halo[a];
    axes_[a].periodic = boundary.low == DPDE_PERIODIC;
    axes_[a].low = {boundary.low == DPDE_VALUE, boundary.value_low};
    axes_[a].high = {boundary.high == DPDE_VALUE, boundary.value_high};
  }
}

void HaloFill::run_bounded_row(double* row, const double* uniforms) const {
  const Axis& x = axes_[0];
  const double low = value_of(x.low.uniform, uniforms), high = value_of(x.high.uniform, uniforms);
  for (int64_t k = 0; k < x.halo; ++k) {
    set_row(row - 1 - k, row + k, 1, x.low.is_value, low);
    set_row(row + x.cells + k, row + x.cells - 1 - k, 1, x.high.is_value, high);
  }
}

void HaloFill::fill_plane_y(double* plane, const double* uniforms) const {
  const Axis& y = axes_[1];
  const double low = value_of(y.low.uniform, uniforms), high = value_of(y.high.uniform, uniforms);
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  const auto row = [&](int64_t place) { return plane + place * stride_[1] + first; };
  for (int64_t k = 0; k < y.halo; ++k) {
    const int64_t mirror_low = y.periodic ? y.cells - 1 - k : k;
    const int64_t mirror_high = y.periodic ? k : y.cells - 1 - k;
    set_row(row(-1 - k), row(mirror_low), count, y.low.is_value, low);
    set_row(row(y.cells + k), row(mirror_high), count, y.high.is_value, high);
  }
}

void HaloFill::run_z(double* base, const double* uniforms) const {
  const Axis& z = axes_[2];
  const double low = value_of(z.low.uniform, uniforms), high = value_of(z.high.uniform, uniforms);
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  for (int64_t k = 0; k < z.halo; ++k) {
    const int64_t mirror_low = z.periodic ? z.cells - 1 - k : k;
    const int64_t mirror_high = z.periodic ? k : z.cells - 1 - k;
    for (int64_t y = -axes_[1].halo; y < axes_[1].cells + axes_[1].halo; ++y) {
      const auto row = [&](int64_t place) { return base + place * stride_[2] + y * stride_[1] + first; };
      set_row(row(-1 - k), row(mirror_low), count, z.low.is_value, low);
      set_row(row(z.cells + k), row(mirror_high), count, z.high.is_value, high);
    }
  }
}

void HaloFill::run_y(double* base, const double* uniforms) const {
  if (axes_[1].halo == 0) return;
  for (int64_t z = 0; z < axes_[2].cells; ++z) fill_plane_y(base + z * stride_[2], uniforms);
}

void HaloFill::set_images(double* row, int64_t y, const double* uniforms) const {
  const Axis& axis = axes_[1];
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  const auto set = [&](int64_t place, const Side& side) {
    set_row(row + (place - y) * stride_[1] + first, row + first, count, side.is_value, value_of(side.uniform, uniforms));
  };
  for (int64_t k = 0; k < axis.halo; ++k) {
    if (y == (axis.periodic ? axis.cells - 1 - k : k)) set(-1 - k, axis.low);
    if (y == (axis.periodic ? k : axis.cells - 1 - k)) set(axis.cells + k, axis.high);
  }
}

void HaloFill::run(double* base, const double* uniforms) const {
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) run_row(base + z * stride_[2] + y * stride_[1], uniforms);
  }
  run_y(base, uniforms);
  run_z(base, uniforms);
}

HaloFold::HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout) : field_(fill.field) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    const bool folds = static_cast<int32_t>(a) < layout.rank && boundary.low != DPDE_PERIODIC;
    stride_[a] = layout.stride[a];
    axes_[a].cells = layout.cells[a];
    axes_[a].grow = folds ? grow[a] : 0;
    axes_[a].low = boundary.low == DPDE_VALUE ? -1 : 1;
    axes_[a].high = boundary.high == DPDE_VALUE ? -1 : 1;
  }
}

void HaloFold::fold_x(double* row) const {
  const Axis& x = axes_[0];
  for (int64_t k = x.grow - 1; k >= 0; --k) {
    fold_row(row + x.cells - 1 - k, row + x.cells + k, 1, x.high);
    fold_row(row + k, row - 1 - k, 1, x.low);
  }
}

/// Folds along y or z; rows along x grown as the axis x is not folded yet. Along y all planes are interior ones, as z is.
void HaloFold::fold_rows(double* base, int axis) const {
  const Axis& along = axes_[static_cast<size_t>(axis)];
  const Axis& other = axes_[axis == 2 ? 1 : 2];
  const int64_t other_grow = axis == 2 ? other.grow : 0;
  const int64_t other_stride = stride_[axis == 2 ? 1 : 2], stride = stride_[static_cast<size_t>(axis)];
  const int64_t count = axes_[0].cells + 2 * axes_[0].grow;
  for (int64_t other_place = -other_grow; other_place < other.cells + other_grow; ++other_place) {
    const auto row = [&](int64_t place) { return base + place * stride + other_place * other_stride - axes_[0].grow; };
    for (int64_t k = along.grow - 1; k >= 0; --k) {
      fold_row(row(along.cells - 1 - k), row(along.cells + k), count, along.high);
      fold_row(row(k), row(-1 - k), count, along.low);
    }
  }
}

void HaloFold::run(double* base) const {
  for (int axis : {2, 1}) {
    if (axes_[static_cast<size_t>(axis)].grow > 0) fold_rows(base, axis);
  }
  if (axes_[0].grow == 0) return;
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) fold_x(base + z * stride_[2] + y * stride_[1]);
  }
}

}  // namespace dpde
