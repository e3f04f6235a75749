// SPDX-License-Identifier: Apache-2.0
// Fills and folds: whole rows along y and z, single cells along x.
#include "fill.h"

#include <algorithm>

namespace dpde {
namespace {

double value_of(int uniform, const double* uniforms) { return uniform < 0 ? 0.0 : uniforms[uniform]; }

/// What a fill puts into a place of layer k: weight*image + rate*c, and on walls farther*(the cell behind the image).
/// In single precision these factors are rounded once.
struct Mirror {
  double weight = 1, rate = 0, farther = 0;
};

/// `cells` along the axis.
Mirror mirror(const dpde_side& side, int64_t k, int64_t cells, const double* uniforms) {
  if (side.kind == DPDE_ON_WALL && k == 0) return {0, 1};
  if (side.kind == DPDE_VALUE || side.kind == DPDE_ON_WALL) return {-1, 2};
  if (side.kind != DPDE_MIXED && side.kind != DPDE_MIXED_ON_WALL) return {};
  const bool on_wall = side.kind == DPDE_MIXED_ON_WALL;
  if (on_wall && k == 0) {
    const double a = value_of(side.a, uniforms), b = value_of(side.b, uniforms);
    if (cells < 3) return {b / (a + b), 1 / (a + b)};
    return {4 * b / (2 * a + 3 * b), 2 / (2 * a + 3 * b), -b / (2 * a + 3 * b)};
  }
  const double way = static_cast<double>(on_wall ? 2 * k : 2 * k + 1);
  const double a = value_of(side.a, uniforms) * way, b = 2 * value_of(side.b, uniforms);
  return {(b - a) / (b + a), 2 * way / (b + a)};
}

/// Adds weight * halo onto `to`, farther * halo onto `behind`, rate * halo onto `wall` if there is one, and clears the
/// halo.
template <class Real>
void fold_row(Real* to, Real* behind, Real* halo, Real* wall, int64_t count, Mirror how) {
  const Real weight = static_cast<Real>(how.weight), rate = static_cast<Real>(how.rate),
             farther = static_cast<Real>(how.farther);
  for (int64_t x = 0; wall != nullptr && x < count; ++x) wall[x] += rate * halo[x];
  for (int64_t x = 0; farther != 0 && x < count; ++x) behind[x] += farther * halo[x];
  for (int64_t x = 0; weight != 0 && x < count; ++x) to[x] += weight * halo[x];
  std::fill_n(halo, count, Real{0});
}

/// `behind` lies one cell farther from the side than the image `from`.
template <class Real>
void set_image_of(Real* to, const Real* from, const Real* behind, int64_t count, const dpde_side& side, Mirror how,
                  const double* uniforms) {
  if (side.kind == DPDE_PERIODIC || side.kind == DPDE_ZERO_GRADIENT) {
    std::copy_n(from, count, to);
    return;
  }
  const Real weight = static_cast<Real>(how.weight),
             constant = static_cast<Real>(how.rate * value_of(side.value, uniforms));
  if (weight == 0) {
    std::fill_n(to, count, constant);
    return;
  }
  if (how.farther != 0) {
    const Real farther = static_cast<Real>(how.farther);
    for (int64_t x = 0; x < count; ++x) to[x] = constant + weight * from[x] + farther * behind[x];
    return;
  }
  for (int64_t x = 0; x < count; ++x) to[x] = constant + weight * from[x];
}

/// The transpose of set_layer; `place` is that of `first` in all fields.
template <class Real>
void fold_layer(Real* first, void* const* fields, int64_t place, int64_t stride, int64_t count, const HaloAxis& axis,
                bool is_low, int64_t k, const double* uniforms) {
  const dpde_side& side = is_low ? axis.low : axis.high;
  const int64_t image = is_low ? axis.low_image(k) : axis.high_image(k),
                halo = is_low ? axis.low_place(k) : axis.high_place(k);
  Real* wall = side.field < 0 ? nullptr : static_cast<Real*>(fields[side.field]) + place + halo * stride;
  fold_row(first + image * stride, first + (is_low ? image + 1 : image - 1) * stride, first + halo * stride, wall,
           count, mirror(side, k, axis.cells, uniforms));
}

/// Layer k of one side of an axis, for `count` values beside one another; `first` points at those of place 0.
template <class Real>
void set_layer(Real* first, int64_t stride, int64_t count, const HaloAxis& axis, bool is_low, int64_t k,
               const double* uniforms) {
  const dpde_side& side = is_low ? axis.low : axis.high;
  const int64_t image = is_low ? axis.low_image(k) : axis.high_image(k);
  Real* to = first + (is_low ? axis.low_place(k) : axis.high_place(k)) * stride;
  const Mirror how = mirror(side, k, axis.cells, uniforms);
  set_image_of(to, first + image * stride, first + (is_low ? image + 1 : image - 1) * stride, count, side, how,
               uniforms);
}

}  // namespace

void set_image(int32_t real, void* to, const void* from, int64_t count, const dpde_side& side, int64_t layer,
               const double* uniforms) {
  with_real(real, [&](auto type) {
    using Real = decltype(type);
    const Real* image = static_cast<const Real*>(from);
    set_image_of(static_cast<Real*>(to), image, image, count, side, mirror(side, layer, 0, uniforms), uniforms);
  });
}

void HaloAxis::set(const dpde_boundary& boundary, int64_t cell_count, int64_t width) {
  periodic = boundary.low.kind == DPDE_PERIODIC;
  on_walls = boundary.low.kind == DPDE_ON_WALL || boundary.low.kind == DPDE_MIXED_ON_WALL;
  low = boundary.low;
  high = boundary.high;
  cells = cell_count;
  halo = width;
}

HaloFill::HaloFill(const dpde_fill& fill, const dpde_layout& layout) : field_(fill.field), real_(layout.real) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    stride_[a] = layout.stride[a];
    axes_[a].set(boundary, layout.cells[a], layout.halo[a]);
    has_walls_ = has_walls_ || (!axes_[a].periodic && (boundary.low.field >= 0 || boundary.high.field >= 0));
  }
}

void HaloFill::run_bounded_row(void* cells, const double* uniforms) const {
  with_real(real_, [&](auto real) {
    auto* row = static_cast<decltype(real)*>(cells);
    axes_[0].outwards([&](bool is_low, int64_t k) { set_layer(row, 1, 1, axes_[0], is_low, k, uniforms); });
  });
}

/// Axis by axis, outwards, one cell after the other. Along periodic axes c is read where the place wraps to.
template <class Real>
void HaloFill::run_walls(void* const* fields, const double* uniforms) const {
  const auto wrapped = [this](size_t axis, int64_t i) {
    const int64_t n = axes_[axis].cells;
    return axes_[axis].periodic ? (i % n + n) % n : i;
  };
  std::array<int64_t, 3> grow{};
  for (size_t a = 0; a < 3; ++a) {
    const HaloAxis& axis = axes_[a];
    axis.outwards([&](bool is_low, int64_t k) {
      const dpde_side& side = is_low ? axis.low : axis.high;
      const Mirror how = axis.periodic ? Mirror{} : mirror(side, k, axis.cells, uniforms);
      const Real* wall = axis.periodic || side.field < 0 ? nullptr : static_cast<const Real*>(fields[side.field]);
      const Real weight = static_cast<Real>(how.weight), rate = static_cast<Real>(how.rate),
                 farther = static_cast<Real>(how.farther);
      const Real constant = axis.periodic || wall ? 0 : static_cast<Real>(how.rate * value_of(side.value, uniforms));
      std::array<int64_t, 3> from{-grow[0], -grow[1], -grow[2]}, to{};
      for (size_t b = 0; b < 3; ++b) to[b] = axes_[b].cells + grow[b];
      from[a] = is_low ? axis.low_place(k) : axis.high_place(k);
      to[a] = from[a] + 1;
      const int64_t image = axis.periodic ? wrapped(a, from[a]) : is_low ? axis.low_image(k) : axis.high_image(k);
      for (int64_t z = from[2]; z < to[2]; ++z) {
        for (int64_t y = from[1]; y < to[1]; ++y) {
          for (int64_t x = from[0]; x < to[0]; ++x) {
            Real* place = static_cast<Real*>(fields[field_]) + x + y * stride_[1] + z * stride_[2];
            const Real c = wall ? wall[wrapped(0, x) + wrapped(1, y) * stride_[1] + wrapped(2, z) * stride_[2]] : 0;
            Real kept = weight == 0 ? 0 : weight * place[(image - from[a]) * stride_[a]];
            if (farther != 0) kept += farther * place[(image + (is_low ? 1 : -1) - from[a]) * stride_[a]];
            *place = kept + rate * c + constant;
          }
        }
      }
    });
    grow[a] = axis.halo;
  }
}

template <class Real>
void HaloFill::fill_plane_y(Real* plane, const double* uniforms) const {
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  axes_[1].outwards(
      [&](bool is_low, int64_t k) { set_layer(plane + first, stride_[1], count, axes_[1], is_low, k, uniforms); });
}

template <class Real>
void HaloFill::fill_z(Real* base, const double* uniforms) const {
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  axes_[2].outwards([&](bool is_low, int64_t k) {
    for (int64_t y = -axes_[1].halo; y < axes_[1].cells + axes_[1].halo; ++y) {
      set_layer(base + y * stride_[1] + first, stride_[2], count, axes_[2], is_low, k, uniforms);
    }
  });
}

void HaloFill::run_y(void* base, const double* uniforms) const {
  if (axes_[1].layers() == 0) return;
  with_real(real_, [&](auto real) {
    for (int64_t z = 0; z < axes_[2].cells; ++z)
      fill_plane_y(static_cast<decltype(real)*>(base) + z * stride_[2], uniforms);
  });
}

void HaloFill::run_z(void* base, const double* uniforms) const {
  with_real(real_, [&](auto real) { fill_z(static_cast<decltype(real)*>(base), uniforms); });
}

void HaloFill::set_images(void* cells, int64_t y, const double* uniforms) const {
  with_real(real_, [&](auto real) {
    auto* row = static_cast<decltype(real)*>(cells);
    const HaloAxis& axis = axes_[1];
    const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
    const auto set = [&](int64_t place, const dpde_side& side, int64_t k) {
      set_image_of(row + (place - y) * stride_[1] + first, row + first, row + first, count, side,
                   mirror(side, k, axis.cells, uniforms), uniforms);
    };
    for (int64_t k = 0; k < axis.layers(); ++k) {
      if (axis.has_low(k) && y == axis.low_image(k)) set(axis.low_place(k), axis.low, k);
      if (y == axis.high_image(k)) set(axis.high_place(k), axis.high, k);
    }
  });
}

void HaloFill::run(void* const* fields, const double* uniforms) const {
  if (!has_walls_) return run_plain(fields[field_], uniforms);
  with_real(real_, [&](auto real) { run_walls<decltype(real)>(fields, uniforms); });
}

void HaloFill::run_plain(void* base, const double* uniforms) const {
  with_real(real_, [&](auto real) {
    auto* cells = static_cast<decltype(real)*>(base);
    for (int64_t z = 0; z < axes_[2].cells; ++z) {
      for (int64_t y = 0; y < axes_[1].cells; ++y) run_row(cells + z * stride_[2] + y * stride_[1], uniforms);
    }
  });
  run_y(base, uniforms);
  run_z(base, uniforms);
}

HaloFold::HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout)
    : field_(fill.field), real_(layout.real) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    const bool folds = static_cast<int32_t>(a) < layout.rank && boundary.low.kind != DPDE_PERIODIC;
    stride_[a] = layout.stride[a];
    axes_[a].set(boundary, layout.cells[a], folds ? grow[a] : 0);
  }
}

template <class Real>
void HaloFold::fold_x(void* const* fields, const double* uniforms, int64_t place) const {
  Real* row = static_cast<Real*>(fields[field_]) + place;
  axes_[0].inwards(
      [&](bool is_low, int64_t k) { fold_layer(row, fields, place, 1, 1, axes_[0], is_low, k, uniforms); });
}

/// Folds along y or z; rows along x grown as the axis x is not folded yet. Along y all planes are interior ones, as z
/// is.
template <class Real>
void HaloFold::fold_rows(void* const* fields, const double* uniforms, int axis) const {
  const HaloAxis& along = axes_[static_cast<size_t>(axis)];
  const HaloAxis& other = axes_[axis == 2 ? 1 : 2];
  const int64_t other_grow = axis == 2 ? other.halo : 0;
  const int64_t other_stride = stride_[axis == 2 ? 1 : 2], stride = stride_[static_cast<size_t>(axis)];
  const int64_t count = axes_[0].cells + 2 * axes_[0].halo;
  Real* folded = static_cast<Real*>(fields[field_]);
  for (int64_t other_place = -other_grow; other_place < other.cells + other_grow; ++other_place) {
    const int64_t first = other_place * other_stride - axes_[0].halo;
    along.inwards([&](bool is_low, int64_t k) {
      fold_layer(folded + first, fields, first, stride, count, along, is_low, k, uniforms);
    });
  }
}

template <class Real>
void HaloFold::fold(void* const* fields, const double* uniforms) const {
  for (int axis : {2, 1}) {
    if (folds(static_cast<size_t>(axis))) fold_rows<Real>(fields, uniforms, axis);
  }
  if (!folds(0)) return;
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) fold_x<Real>(fields, uniforms, z * stride_[2] + y * stride_[1]);
  }
}

void HaloFold::run(void* const* fields, const double* uniforms) const {
  with_real(real_, [&](auto real) { fold<decltype(real)>(fields, uniforms); });
}

}  // namespace dpde
