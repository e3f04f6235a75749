// SPDX-License-Identifier: Apache-2.0
// Transport by upwind differences, see upwind_difference.h.
#include <vector>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/space/discretise.h"
#include "stencil/space/upwind_difference.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

Limiter limiter_of(const model::Transport& transport, Precision real) {
  switch (transport.limiter) {
    case model::Limiter::minmod: return minmod_slope;
    case model::Limiter::van_leer: return real == Precision::f32 ? van_leer_slope_in_f32 : van_leer_slope;
    case model::Limiter::mc: return mc_slope;
  }
  unreachable("limiter");
}

}  // namespace

Expr Discretiser::velocity(const model::Expr& e, const model::Placement& placement) {
  const bool fits = base_ || placements_.natural(e).value_or(placement) == placement;
  return (*this)(fits ? e : model::interpolate(e), placement);
}

/// A linear scheme computes both one-sided differences, times the positive and negative parts of the speed. A nonlinear
/// scheme chooses the side first, as its difference costs more. At speed 0 both use the side of a positive speed.
Discretiser::Quotient Discretiser::upwind_at(const model::Advect& e, const Place& place) {
  for (int axis = 0; axis < max_rank; ++axis) {
    if (is_midway(place, axis)) return at_halfway(model::Expr(model::Node{e}), place, axis);
  }
  const model::Transport& transport = model::transport_of(scheme_, e);
  Expr sum = 0.0;
  for (int axis = 0; axis < static_cast<int>(e.velocity.size()); ++axis) {
    if (is_literal(e.velocity[axis], 0)) continue;
    Expr speed = velocity_at(e.velocity[axis], place).value();
    const auto cell = [&](int distance) {
      Place there = place;
      there[axis] += 2 * distance;
      return distance == 0 ? at(e.operand, place).value() : inside_difference(e.operand, there).value();
    };
    if (transport.advect == model::Advection::upwind) {
      if (nesting_ == 0) speed = shared("velocity_" + axis_letter(axis), speed);
      const auto part = [&](Fn side, const Rise& rise) {
        const UpwindDifference difference = upwind_difference(transport.order, rise);
        return call(side, {speed, 0.0}) * difference.sum / (difference.denominator * spacing(axis));
      };
      sum = sum + part(Fn::max, [&](int k) { return cell(k) - cell(k - 1); });
      sum = sum + part(Fn::min, [&](int k) { return cell(1 - k) - cell(-k); });
    } else {
      speed = shared("velocity_" + axis_letter(axis), speed);
      sum = sum + speed * chosen_difference(transport, speed, cell) / spacing(axis);
    }
  }
  return Quotient{sum};
}

/// Lets are allowed inside these differences: each belongs to its own point and is not used elsewhere.
Expr Discretiser::chosen_difference(const model::Transport& transport, const Expr& speed,
                                    const std::function<Expr(int)>& cell) {
  const auto share = [this](const std::string& wish, const Expr& value) { return shared(wish, value); };
  const bool is_weno = transport.advect == model::Advection::weno;
  const int upstream = is_weno ? (transport.order + 1) / 2 : 2;
  std::vector<Expr> faces;  // rises across those between the cells -upstream to upstream
  for (int k = 1 - upstream; k <= upstream; ++k) faces.push_back(share("rise", cell(k) - cell(k - 1)));
  const auto face = [&](int k) { return faces[static_cast<std::size_t>(k - 1 + upstream)]; };
  std::vector<Expr> rises;
  for (int k = 1 - upstream; k < upstream; ++k)
    rises.push_back(share("rise", select(binary(BinaryOp::greater_equal, speed, 0.0), face(k), face(1 - k))));
  const Rise rise = [&](int k) { return rises[static_cast<std::size_t>(k - 1 + upstream)]; };
  return share("difference", is_weno ? weno_difference(transport.order, rise, share, scheme_.real)
                                     : muscl_difference(limiter_of(transport, scheme_.real), rise, share));
}

}  // namespace dpde::stencil
