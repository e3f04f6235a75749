// SPDX-License-Identifier: Apache-2.0
#include "grid/halo_axis.h"

#include <fmt/format.h>

#include <algorithm>

#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"

namespace dpde {
namespace {

double at(const dpde_ghost_number& number, double way) { return number.fixed + number.per_distance * way; }

bool is_zero(const dpde_ghost_number& number) { return number.fixed == 0 && number.per_distance == 0; }

bool reads_inside(const dpde_side& side, const dpde_ghost_row& row, dpde_ghost_number dpde_ghost_term::*from) {
  for (int t = 0; t < DPDE_SIDE_COEFFICIENTS; ++t) {
    if (side.coefficients[t] != DPDE_ZERO && !is_zero(row.terms[t].*from)) return true;
  }
  return false;
}

bool makes_nothing(const dpde_ghost_row& row) {
  return std::ranges::all_of(row.terms, [](const dpde_ghost_term& term) { return is_zero(term.ghost); });
}

const dpde_ghost_row& row_of(const dpde_ghost_rows& rows, int64_t cells) {
  return cells < rows.least ? rows.of_few : rows.row;
}

}  // namespace

HaloLayer::HaloLayer(const dpde_side& side, int64_t cells, int64_t global, bool is_low, int64_t layer)
    : place(0), mirror(0), second(0), value_(side.value), field_(side.field) {
  const dpde_rule& rule = *side.rule;
  const int64_t on_walls = rule.on_walls;
  row_ = &row_of(on_walls != 0 && layer == 0 ? rule.wall : rule.beyond, global);
  way_ = static_cast<double>(2 * layer + 1 - on_walls);
  const auto cell = [&](int64_t inside) { return is_low ? inside : cells - 1 - on_walls - inside; };
  const int64_t inside = row_->first + row_->step * layer;
  place = cell(-1 - layer);
  mirror = cell(inside);
  second = cell(inside + 1);
  std::ranges::copy(side.coefficients, coefficients_);
  is_number_ = std::ranges::all_of(side.coefficients, [](int32_t c) { return c < 0; });
  reads_mirror_ = dpde::reads_inside(side, *row_, &dpde_ghost_term::mirror);
  reads_second_ = dpde::reads_inside(side, *row_, &dpde_ghost_term::second);
  is_made_ = !makes_nothing(*row_);
  turns_ = is_pole(side);
  if (is_number_ && is_made_) ghost_ = computed(nullptr);
  copies_ = !turns_ && is_number_ && !reads_second_ && ghost_.weight == 1 && value_ < 0 && field_ < 0;
}

Ghost HaloLayer::computed(const double* uniforms) const {
  double at_place = 0, at_mirror = 0, at_second = 0;
  for (int t = 0; t < DPDE_SIDE_COEFFICIENTS; ++t) {
    if (coefficients_[t] == DPDE_ZERO) continue;
    const double coefficient = coefficients_[t] == DPDE_ONE ? 1.0 : uniforms[coefficients_[t]];
    at_place += coefficient * at(row_->terms[t].ghost, way_);
    at_mirror += coefficient * at(row_->terms[t].mirror, way_);
    at_second += coefficient * at(row_->terms[t].second, way_);
  }
  return {-at_mirror / at_place, -at_second / at_place, at(row_->rate, way_) / at_place};
}

HaloAxis::HaloAxis(const dpde_boundary& boundary, const dpde_layout& layout, std::size_t axis, int64_t width)
    : periodic(boundary.low.rule == nullptr && !is_divided(layout, axis)), cells(layout.cells[axis]), halo(width) {
  for (int64_t k = 0; periodic && k < halo; ++k) {
    layers.emplace_back(-1 - k, cells - 1 - k);
    layers.emplace_back(cells + k, k);
  }
  if (boundary.low.rule == nullptr) return;
  const bool on_walls = boundary.low.rule->on_walls != 0;
  const bool has_low = !has_low_seam(layout, axis), has_high = !has_high_seam(layout, axis);
  const int64_t global = layout.global[axis];
  for (int64_t k = 0; k < halo + (on_walls ? 1 : 0); ++k) {
    const bool is_wall = on_walls && k == 0;
    const HaloLayer low(boundary.low, cells, global, true, k), high(boundary.high, cells, global, false, k);
    if (has_low && k < halo && !is_wall) layers.push_back(low);
    const bool stays = is_wall && global == 1 && high.reads_inside();
    if (has_high && !stays && high.is_made()) layers.push_back(high);
    if (has_low && k < halo && is_wall) layers.push_back(low);
  }
  const auto has = [&](int64_t place) { return place >= 0 && place < cells; };
  for (const HaloLayer& layer : layers) {
    const bool is_own = (!layer.reads_inside() || has(layer.mirror)) && (!layer.reads_second() || has(layer.second));
    if (is_divided(layout, axis) && !is_own) {
      throw Error(ErrorKind::input,
                  fmt::format("axis {} is divided among ranks, and {} cells of one are too few for a condition at its "
                              "side, which reads others",
                              "xyz"[axis], cells));
    }
  }
}

bool HaloAxis::images_are_direct() const {
  return std::ranges::all_of(layers, [&](const HaloLayer& layer) {
    const bool is_beyond = layer.place < 0 || layer.place >= cells;
    return is_beyond && layer.mirror >= 0 && layer.mirror < cells && !layer.reads_second();
  });
}

bool is_pole(const dpde_side& side) { return side.rule != nullptr && side.rule->turns != 0; }

bool is_mirrored(const dpde_side& side) {
  if (side.rule == nullptr) return true;
  if (is_pole(side)) return false;
  const dpde_ghost_rows& beyond = side.rule->beyond;
  return side.field < 0 && side.rule->on_walls == 0 && beyond.least <= 1 && beyond.row.first == 0 &&
         beyond.row.step == 1 && !reads_inside(side, beyond.row, &dpde_ghost_term::second);
}

}  // namespace dpde
