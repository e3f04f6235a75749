// SPDX-License-Identifier: Apache-2.0
// Transport by differences from upwind: of order 1, or of order 3 with two cells upwind and one downwind.
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/discretise.h"

namespace dpde::stencil {

Discretiser::Quotient Discretiser::upwind_at(const model::Advect& e, const Place& place) {
  for (int axis = 0; axis < max_rank; ++axis) {
    if (is_midway(place, axis)) return at_halfway(model::Expr(model::Node{e}), place, axis);
  }
  Expr sum = 0.0;
  for (int axis = 0; axis < static_cast<int>(e.velocity.size()); ++axis) {
    if (model::is_constant(e.velocity[axis], 0)) continue;
    Expr speed = velocity_at(e.velocity[axis], place).value();
    if (nesting_ == 0) speed = shared("velocity_" + axis_letter(axis), speed);
    const auto cell = [&](int distance) {
      Place there = place;
      there[axis] += 2 * distance;
      return distance == 0 ? at(e.operand, place).value() : inside_difference(e.operand, there).value();
    };
    const Expr rise_before = cell(0) - cell(-1), rise_after = cell(1) - cell(0);
    const Expr forward = call(Fn::max, {speed, 0.0}), backward = call(Fn::min, {speed, 0.0});
    if (scheme_.advect_order < 3) {
      sum = sum + forward * rise_before / spacing(axis) + backward * rise_after / spacing(axis);
    } else {
      const Expr from_low = 2.0 * rise_after + 5.0 * rise_before - (cell(-1) - cell(-2));
      const Expr from_high = 2.0 * rise_before + 5.0 * rise_after - (cell(2) - cell(1));
      const Expr bottom = 6.0 * spacing(axis);
      sum = sum + forward * from_low / bottom + backward * from_high / bottom;
    }
  }
  return Quotient{sum};
}

}  // namespace dpde::stencil
