// SPDX-License-Identifier: Apache-2.0
#include "model/wall_coefficient.h"

#include <algorithm>

#include "model/build.h"

namespace dpde::model {

namespace {

bool is_in_a_boundary(const Problem& problem, const std::string& coefficient) {
  return std::ranges::any_of(problem.states, [&](const State& state) {
    return std::ranges::any_of(state.boundary, [&](const AxisSides& sides) {
      return reads(sides.low.value, coefficient) || reads(sides.high.value, coefficient);
    });
  });
}

}  // namespace

bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low) {
  if (problem.axes[axis].topology == Topology::periodic || coefficient.placement[axis] || coefficient.walls ||
      is_in_a_boundary(problem, coefficient.name))
    return false;
  return std::ranges::any_of(problem.states, [&](const State& state) {
    if (axis >= state.boundary.size()) return false;
    const SideKind kind = is_low ? state.boundary[axis].low.kind : state.boundary[axis].high.kind;
    return kind == SideKind::gradient || kind == SideKind::mixed;
  });
}

}  // namespace dpde::model
