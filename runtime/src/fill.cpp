// SPDX-License-Identifier: Apache-2.0
// Fills and folds: whole rows along y and z, single cells along x.
#include "fill.h"

#include <algorithm>

namespace dpde {
namespace {

double value_of(int uniform, const double* uniforms) { return uniform < 0 ? 0.0 : uniforms[uniform]; }

/// What a fill puts into a place of layer k: weight*image + rate*c.
struct Mirror {
  double weight = 1, rate = 0;
};

Mirror mirror(const dpde_side& side, int64_t k, const double* uniforms) {
  if (side.kind == DPDE_VALUE) return {-1, 2};
  if (side.kind != DPDE_MIXED) return {};
  const double way = static_cast<double>(2 * k + 1);
  const double a = value_of(side.a, uniforms) * way, b = 2 * value_of(side.b, uniforms);
  return {(b - a) / (b + a), 2 * way / (b + a)};
}

/// Adds weight * halo onto `to`, rate * halo onto `wall` if there is one, and clears the halo.
void fold_row(double* to, double* halo, double* wall, int64_t count, Mirror how) {
  for (int64_t x = 0; wall != nullptr && x < count; ++x) wall[x] += how.rate * halo[x];
  for (int64_t x = 0; x < count; ++x) {
    to[x] += how.weight * halo[x];
    halo[x] = 0;
  }
}

}  // namespace

void set_image(double* to, const double* from, int64_t count, const dpde_side& side, int64_t layer, const double* uniforms) {
  if (side.kind != DPDE_VALUE && side.kind != DPDE_MIXED) {
    std::copy_n(from, count, to);
    return;
  }
  const Mirror how = mirror(side, layer, uniforms);
  const double constant = how.rate * value_of(side.value, uniforms);
  for (int64_t x = 0; x < count; ++x) to[x] = constant + how.weight * from[x];
}

HaloFill::HaloFill(const dpde_fill& fill, const dpde_layout& layout) : field_(fill.field) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    stride_[a] = layout.stride[a];
    axes_[a].cells = layout.cells[a];
    axes_[a].halo = layout.halo[a];
    axes_[a].periodic = boundary.low.kind == DPDE_PERIODIC;
    axes_[a].low = boundary.low;
    axes_[a].high = boundary.high;
    has_walls_ = has_walls_ || (!axes_[a].periodic && (boundary.low.field >= 0 || boundary.high.field >= 0));
  }
}

void HaloFill::run_bounded_row(double* row, const double* uniforms) const {
  const Axis& x = axes_[0];
  for (int64_t k = 0; k < x.halo; ++k) {
    set_image(row - 1 - k, row + k, 1, x.low, k, uniforms);
    set_image(row + x.cells + k, row + x.cells - 1 - k, 1, x.high, k, uniforms);
  }
}

/// Axis by axis, outwards, one cell after the other. Along periodic axes c is read where the place wraps to.
void HaloFill::run_walls(double* const* fields, const double* uniforms) const {
  const auto wrapped = [this](size_t axis, int64_t i) {
    const int64_t n = axes_[axis].cells;
    return axes_[axis].periodic ? (i % n + n) % n : i;
  };
  std::array<int64_t, 3> grow{};
  for (size_t a = 0; a < 3; ++a) {
    const Axis& axis = axes_[a];
    for (int64_t layer = 0; layer < 2 * axis.halo; ++layer) {
      const int64_t k = layer / 2;
      const bool is_low = layer % 2 == 0;
      const dpde_side& side = is_low ? axis.low : axis.high;
      const Mirror how = axis.periodic ? Mirror{} : mirror(side, k, uniforms);
      const double* wall = axis.periodic || side.field < 0 ? nullptr : fields[side.field];
      const double constant = axis.periodic || wall ? 0 : how.rate * value_of(side.value, uniforms);
      std::array<int64_t, 3> from{-grow[0], -grow[1], -grow[2]}, to{};
      for (size_t b = 0; b < 3; ++b) to[b] = axes_[b].cells + grow[b];
      from[a] = is_low ? -1 - k : axis.cells + k;
      to[a] = from[a] + 1;
      const int64_t image = axis.periodic ? wrapped(a, from[a]) : is_low ? k : axis.cells - 1 - k;
      for (int64_t z = from[2]; z < to[2]; ++z) {
        for (int64_t y = from[1]; y < to[1]; ++y) {
          for (int64_t x = from[0]; x < to[0]; ++x) {
            double* place = fields[field_] + x + y * stride_[1] + z * stride_[2];
            const double c = wall ? wall[wrapped(0, x) + wrapped(1, y) * stride_[1] + wrapped(2, z) * stride_[2]] : 0;
            *place = how.weight * place[(image - from[a]) * stride_[a]] + how.rate * c + constant;
          }
        }
      }
    }
    grow[a] = axis.halo;
  }
}

void HaloFill::fill_plane_y(double* plane, const double* uniforms) const {
  const Axis& y = axes_[1];
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  const auto row = [&](int64_t place) { return plane + place * stride_[1] + first; };
  for (int64_t k = 0; k < y.halo; ++k) {
    const int64_t mirror_low = y.periodic ? y.cells - 1 - k : k;
    const int64_t mirror_high = y.periodic ? k : y.cells - 1 - k;
    set_image(row(-1 - k), row(mirror_low), count, y.low, k, uniforms);
    set_image(row(y.cells + k), row(mirror_high), count, y.high, k, uniforms);
  }
}

void HaloFill::run_z(double* base, const double* uniforms) const {
  const Axis& z = axes_[2];
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  for (int64_t k = 0; k < z.halo; ++k) {
    const int64_t mirror_low = z.periodic ? z.cells - 1 - k : k;
    const int64_t mirror_high = z.periodic ? k : z.cells - 1 - k;
    for (int64_t y = -axes_[1].halo; y < axes_[1].cells + axes_[1].halo; ++y) {
      const auto row = [&](int64_t place) { return base + place * stride_[2] + y * stride_[1] + first; };
      set_image(row(-1 - k), row(mirror_low), count, z.low, k, uniforms);
      set_image(row(z.cells + k), row(mirror_high), count, z.high, k, uniforms);
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
  const auto set = [&](int64_t place, const dpde_side& side, int64_t k) {
    set_image(row + (place - y) * stride_[1] + first, row + first, count, side, k, uniforms);
  };
  for (int64_t k = 0; k < axis.halo; ++k) {
    if (y == (axis.periodic ? axis.cells - 1 - k : k)) set(-1 - k, axis.low, k);
    if (y == (axis.periodic ? k : axis.cells - 1 - k)) set(axis.cells + k, axis.high, k);
  }
}

void HaloFill::run(double* const* fields, const double* uniforms) const {
  if (has_walls_) return run_walls(fields, uniforms);
  run_plain(fields[field_], uniforms);
}

void HaloFill::run_plain(double* base, const double* uniforms) const {
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) run_row(base + z * stride_[2] + y * stride_[1], uniforms);
  }
  run_y(base, uniforms);
  run_z(base, uniforms);
}

HaloFold::HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout) : field_(fill.field) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    const bool folds = static_cast<int32_t>(a) < layout.rank && boundary.low.kind != DPDE_PERIODIC;
    stride_[a] = layout.stride[a];
    axes_[a].cells = layout.cells[a];
    axes_[a].grow = folds ? grow[a] : 0;
    axes_[a].low = boundary.low;
    axes_[a].high = boundary.high;
  }
}

void HaloFold::fold_x(double* const* fields, const double* uniforms, int64_t place) const {
  const Axis& x = axes_[0];
  double* row = fields[field_] + place;
  const auto fold = [&](const dpde_side& side, int64_t image, int64_t halo, int64_t k) {
    double* wall = side.field < 0 ? nullptr : fields[side.field] + place + halo;
    fold_row(row + image, row + halo, wall, 1, mirror(side, k, uniforms));
  };
  for (int64_t k = x.grow - 1; k >= 0; --k) {
    fold(x.high, x.cells - 1 - k, x.cells + k, k);
    fold(x.low, k, -1 - k, k);
  }
}

/// Folds along y or z; rows along x grown as the axis x is not folded yet. Along y all planes are interior ones, as z is.
void HaloFold::fold_rows(double* const* fields, const double* uniforms, int axis) const {
  const Axis& along = axes_[static_cast<size_t>(axis)];
  const Axis& other = axes_[axis == 2 ? 1 : 2];
  const int64_t other_grow = axis == 2 ? other.grow : 0;
  const int64_t other_stride = stride_[axis == 2 ? 1 : 2], stride = stride_[static_cast<size_t>(axis)];
  const int64_t count = axes_[0].cells + 2 * axes_[0].grow;
  for (int64_t other_place = -other_grow; other_place < other.cells + other_grow; ++other_place) {
    const auto row = [&](int64_t place) { return place * stride + other_place * other_stride - axes_[0].grow; };
    const auto fold = [&](const dpde_side& side, int64_t image, int64_t halo, int64_t k) {
      double* wall = side.field < 0 ? nullptr : fields[side.field] + row(halo);
      fold_row(fields[field_] + row(image), fields[field_] + row(halo), wall, count, mirror(side, k, uniforms));
    };
    for (int64_t k = along.grow - 1; k >= 0; --k) {
      fold(along.high, along.cells - 1 - k, along.cells + k, k);
      fold(along.low, k, -1 - k, k);
    }
  }
}

void HaloFold::run(double* const* fields, const double* uniforms) const {
  for (int axis : {2, 1}) {
    if (axes_[static_cast<size_t>(axis)].grow > 0) fold_rows(fields, uniforms, axis);
  }
  if (axes_[0].grow == 0) return;
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) fold_x(fields, uniforms, z * stride_[2] + y * stride_[1]);
  }
}

}  // namespace dpde
