// SPDX-License-Identifier: Apache-2.0
// Fills and folds: whole rows at a time along y and z, single cells along x.
#include "grid/fill.h"

#include <algorithm>
#include <ranges>

#include "grid/rows.h"

namespace dpde {
namespace {

/// Transpose of a fill: adds weight * halo to `to`, second_weight * halo to `second`, rate * halo to `wall` if there is
/// one, and clears the halo.
template <class Real>
void fold_row(Real* to, Real* second, Real* halo, Real* wall, int64_t count, Ghost how) {
  const Real weight = static_cast<Real>(how.weight), rate = static_cast<Real>(how.rate),
             second_weight = static_cast<Real>(how.second_weight);
  for (int64_t x = 0; wall != nullptr && x < count; ++x) wall[x] += rate * halo[x];
  for (int64_t x = 0; second_weight != 0 && x < count; ++x) second[x] += second_weight * halo[x];
  for (int64_t x = 0; weight != 0 && x < count; ++x) to[x] += weight * halo[x];
  std::fill_n(halo, count, Real{0});
}

/// `to`, `from` and `second` point at the ghost cells of the layer, their mirror cells and the cells one farther
/// inside.
template <class Real>
void set_layer_from(Real* to, const Real* from, const Real* second, int64_t count, const HaloLayer& layer,
                    const double* uniforms) {
  if (layer.copies()) {
    std::copy_n(from, count, to);
    return;
  }
  const Ghost how = layer.ghost(uniforms);
  const Real weight = static_cast<Real>(how.weight), constant = static_cast<Real>(how.rate * layer.value(uniforms));
  if (weight == 0) {
    std::fill_n(to, count, constant);
    return;
  }
  if (how.second_weight != 0) {
    const Real second_weight = static_cast<Real>(how.second_weight);
    for (int64_t x = 0; x < count; ++x) to[x] = constant + weight * from[x] + second_weight * second[x];
    return;
  }
  for (int64_t x = 0; x < count; ++x) to[x] = constant + weight * from[x];
}

/// For `count` adjacent values; `first` points at those with index 0 along the axis.
template <class Real>
void set_layer(Real* first, int64_t stride, int64_t count, const HaloLayer& layer, const double* uniforms) {
  set_layer_from(first + layer.place * stride, first + layer.mirror * stride, first + layer.second * stride, count,
                 layer, uniforms);
}

/// The transpose of set_layer; `place` is the element index of `first` in all fields.
template <class Real>
void fold_layer(Real* first, void* const* fields, int64_t place, int64_t stride, int64_t count, const HaloLayer& layer,
                const double* uniforms) {
  Real* wall = layer.field() < 0 ? nullptr : static_cast<Real*>(fields[layer.field()]) + place + layer.place * stride;
  fold_row(first + layer.mirror * stride, first + layer.second * stride, first + layer.place * stride, wall, count,
           layer.ghost(uniforms));
}

/// At a pole of `axis`: offset of the mirror cell of a cell with index `along` on the axis around the pole.
int64_t turn(const std::array<HaloAxis, 3>& axes, const std::array<int64_t, 3>& strides, size_t axis, int64_t along) {
  const size_t around = axis_around_pole(axis);
  return (half_a_turn_from(along, axes[around].cells) - along) * strides[around];
}

/// For one cell at a pole: `away` is the offset of its mirror cell from the one without the half turn.
template <class Real>
void fold_turned(Real* first, int64_t stride, int64_t away, const HaloLayer& layer, const double* uniforms) {
  Real& halo = first[layer.place * stride];
  first[layer.mirror * stride + away] += static_cast<Real>(layer.ghost(uniforms).weight) * halo;
  halo = 0;
}

/// Waking threads costs as much as some hundred rows.
int64_t parts_for(const Team& team, int64_t rows) { return rows < 2048 ? 1 : team.threads(); }

}  // namespace

HaloFill::HaloFill(const dpde_fill& fill, const dpde_layout& layout, HaloExchange* exchange)
    : field_(fill.field), real_(layout.real), exchange_(exchange) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    stride_[a] = layout.stride[a];
    axes_[a] = HaloAxis(boundary, layout, a, layout.halo[a]);
    is_ring_[a] = boundary.low.rule == nullptr;
    for (const dpde_side* side : {&boundary.low, &boundary.high}) {
      if (is_ring_[a]) continue;
      is_of_all_ = is_of_all_ || side->field >= 0 || is_pole(*side);
      if (exchange != nullptr && side->field >= 0) walls_.push_back(side->field);
    }
  }
  images_are_direct_ = axes_[1].images_are_direct();
}

void HaloFill::set_image(size_t axis, bool is_low, int64_t k, void* to, const void* from, int64_t count,
                         const double* uniforms) const {
  with_real(real_, [&](auto type) {
    using Real = decltype(type);
    const Real* mirror = static_cast<const Real*>(from);
    set_layer_from(static_cast<Real*>(to), mirror, mirror, count, axes_[axis].beyond(is_low, k), uniforms);
  });
}

void HaloFill::run_bounded_row(void* cells, const double* uniforms) const {
  with_real(real_, [&](auto real) {
    auto* row = static_cast<decltype(real)*>(cells);
    for (const HaloLayer& layer : axes_[0].layers) set_layer(row, 1, 1, layer, uniforms);
  });
}

/// Axis by axis, outwards, one cell after the other. Along periodic axes c is read at the wrapped position; if the axis
/// is divided, from the halo of c.
template <class Real>
void HaloFill::run_cells(void* const* fields, const double* uniforms) const {
  const auto wrapped = [this](size_t axis, int64_t i) {
    const int64_t n = axes_[axis].cells;
    return axes_[axis].periodic ? (i % n + n) % n : i;
  };
  std::array<int64_t, 3> grow{};
  for (size_t a = 0; a < 3; ++a) {
    for (const HaloLayer& layer : axes_[a].layers) {
      const Ghost how = layer.ghost(uniforms);
      const Real* wall = layer.field() < 0 ? nullptr : static_cast<const Real*>(fields[layer.field()]);
      const Real weight = static_cast<Real>(how.weight), rate = static_cast<Real>(how.rate),
                 second_weight = static_cast<Real>(how.second_weight);
      const Real constant = wall ? 0 : static_cast<Real>(how.rate * layer.value(uniforms));
      const int64_t mirror = (wrapped(a, layer.mirror) - layer.place) * stride_[a],
                    second = (layer.second - layer.place) * stride_[a];
      std::array<int64_t, 3> from{-grow[0], -grow[1], -grow[2]}, to{};
      for (size_t b = 0; b < 3; ++b) to[b] = axes_[b].cells + grow[b];
      from[a] = layer.place;
      to[a] = from[a] + 1;
      for (int64_t z = from[2]; z < to[2]; ++z) {
        for (int64_t y = from[1]; y < to[1]; ++y) {
          for (int64_t x = from[0]; x < to[0]; ++x) {
            Real* place = static_cast<Real*>(fields[field_]) + x + y * stride_[1] + z * stride_[2];
            const Real c = wall ? wall[wrapped(0, x) + wrapped(1, y) * stride_[1] + wrapped(2, z) * stride_[2]] : 0;
            const int64_t away = layer.turns() ? turn(axes_, stride_, a, a == 0 ? y : x) : 0;
            Real kept = weight == 0 ? 0 : weight * place[mirror + away];
            if (second_weight != 0) kept += second_weight * place[second + away];
            *place = kept + rate * c + constant;
          }
        }
      }
    }
    grow[a] = axes_[a].halo;
    meet(fields[field_], a);
  }
}

template <class Real>
void HaloFill::fill_plane_y(Real* plane, const double* uniforms) const {
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  for (const HaloLayer& layer : axes_[1].layers) set_layer(plane + first, stride_[1], count, layer, uniforms);
}

template <class Real>
void HaloFill::fill_row_z(Real* row, const double* uniforms) const {
  const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
  for (const HaloLayer& layer : axes_[2].layers) set_layer(row + first, stride_[2], count, layer, uniforms);
}

void HaloFill::run_y(void* base, const double* uniforms, const Team& team) const {
  if (axes_[1].layers.empty()) return;
  with_real(real_, [&](auto real) {
    auto* const cells = static_cast<decltype(real)*>(base);
    const int64_t planes = axes_[2].cells, layers = static_cast<int64_t>(axes_[1].layers.size());
    share_rows(team, parts_for(team, planes * layers), 1, planes,
               [&](int64_t, int64_t z) { fill_plane_y(cells + z * stride_[2], uniforms); });
  });
}

void HaloFill::run_z(void* base, const double* uniforms, const Team& team) const {
  if (axes_[2].layers.empty()) return;
  with_real(real_, [&](auto real) {
    auto* const cells = static_cast<decltype(real)*>(base);
    const int64_t rows = axes_[1].cells + 2 * axes_[1].halo, layers = static_cast<int64_t>(axes_[2].layers.size());
    share_rows(team, parts_for(team, rows * layers), rows, 1,
               [&](int64_t y, int64_t) { fill_row_z(cells + (y - axes_[1].halo) * stride_[1], uniforms); });
  });
}

void HaloFill::set_images(void* cells, int64_t y, const double* uniforms) const {
  with_real(real_, [&](auto real) {
    auto* row = static_cast<decltype(real)*>(cells);
    const int64_t first = -axes_[0].halo, count = axes_[0].cells + 2 * axes_[0].halo;
    for (const HaloLayer& layer : axes_[1].layers) {
      if (layer.mirror == y) set_layer(row - y * stride_[1] + first, stride_[1], count, layer, uniforms);
    }
  });
}

void HaloFill::run(void* const* fields, const double* uniforms, const Team& team) const {
  if (!is_of_all_) return run_plain(fields[field_], uniforms, team);
  for (const int wall : walls_) {
    for (size_t a = 0; a < 3; ++a) exchange_->run(fields[wall], a, is_ring_[a]);
  }
  with_real(real_, [&](auto real) { run_cells<decltype(real)>(fields, uniforms); });
}

void HaloFill::run_plain(void* base, const double* uniforms, const Team& team) const {
  const int64_t ny = axes_[1].cells, nz = axes_[2].cells;
  with_real(real_, [&](auto real) {
    auto* const cells = static_cast<decltype(real)*>(base);
    share_rows(team, parts_for(team, ny * nz), ny, nz,
               [&](int64_t y, int64_t z) { run_row(cells + z * stride_[2] + y * stride_[1], uniforms); });
  });
  meet(base, 0);
  run_y(base, uniforms, team);
  meet(base, 1);
  run_z(base, uniforms, team);
  meet(base, 2);
}

HaloFold::HaloFold(const dpde_fill& fill, const int64_t* grow, const dpde_layout& layout)
    : field_(fill.field), real_(layout.real) {
  for (size_t a = 0; a < 3; ++a) {
    const dpde_boundary& boundary = fill.axes[a];
    const bool folds = static_cast<int32_t>(a) < layout.rank && boundary.low.rule != nullptr;
    stride_[a] = layout.stride[a];
    axes_[a] = HaloAxis(boundary, layout, a, folds ? grow[a] : 0);
  }
}

template <class Real>
void HaloFold::fold_x(void* const* fields, const double* uniforms, int64_t place) const {
  Real* row = static_cast<Real*>(fields[field_]) + place;
  for (const HaloLayer& layer : axes_[0].layers | std::views::reverse)
    fold_layer(row, fields, place, 1, 1, layer, uniforms);
}

/// Layer by layer, since the halo of one row is added to another row.
template <class Real>
void HaloFold::fold_x_at_pole(void* const* fields, const double* uniforms, int64_t z) const {
  for (const HaloLayer& layer : axes_[0].layers | std::views::reverse) {
    for (int64_t y = 0; y < axes_[1].cells; ++y) {
      const int64_t place = z * stride_[2] + y * stride_[1];
      Real* row = static_cast<Real*>(fields[field_]) + place;
      if (layer.turns()) fold_turned(row, 1, turn(axes_, stride_, 0, y), layer, uniforms);
      if (!layer.turns()) fold_layer(row, fields, place, 1, 1, layer, uniforms);
    }
  }
}

/// Folds along y or z. Rows along x are extended, since the axis x is not folded yet. Along y only interior planes are
/// left, since z is folded before.
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
    for (const HaloLayer& layer : along.layers | std::views::reverse) {
      if (!layer.turns()) fold_layer(folded + first, fields, first, stride, count, layer, uniforms);
      for (int64_t x = 0; layer.turns() && x < count; ++x)
        fold_turned(folded + first + x, stride, turn(axes_, stride_, 1, x), layer, uniforms);
    }
  }
}

template <class Real>
void HaloFold::fold(void* const* fields, const double* uniforms) const {
  for (int axis : {2, 1}) {
    if (folds(static_cast<size_t>(axis))) fold_rows<Real>(fields, uniforms, axis);
  }
  if (!folds(0)) return;
  const bool has_pole = std::ranges::any_of(axes_[0].layers, &HaloLayer::turns);
  for (int64_t z = 0; z < axes_[2].cells; ++z) {
    if (has_pole) fold_x_at_pole<Real>(fields, uniforms, z);
    for (int64_t y = 0; !has_pole && y < axes_[1].cells; ++y)
      fold_x<Real>(fields, uniforms, z * stride_[2] + y * stride_[1]);
  }
}

void HaloFold::run(void* const* fields, const double* uniforms) const {
  with_real(real_, [&](auto real) { fold<decltype(real)>(fields, uniforms); });
}

}  // namespace dpde
