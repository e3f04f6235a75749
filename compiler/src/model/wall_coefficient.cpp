// SPDX-License-Identifier: Apache-2.0
#include "model/wall_coefficient.h"

#include <algorithm>

#include "model/build.h"
#include "model/solves.h"

namespace dpde::model {

namespace {

/// Of states and of what is solved for.
std::vector<const std::vector<AxisSides>*> boundaries_of(const Problem& problem) {
  std::vector<const std::vector<AxisSides>*> boundaries;
  for (const State& state : problem.states) boundaries.push_back(&state.boundary);
  for (const Solve* solve : solves_of(problem)) boundaries.push_back(&solve->boundary);
  return boundaries;
}

bool is_in_a_boundary(const Problem& problem, const std::string& coefficient) {
  return std::ranges::any_of(boundaries_of(problem), [&](const std::vector<AxisSides>* boundary) {
    return std::ranges::any_of(*boundary, [&](const AxisSides& sides) {
      return reads(sides.low.value, coefficient) || reads(sides.high.value, coefficient);
    });
  });
}

}  // namespace

bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low) {
  if (problem.axes[axis].topology == Topology::periodic || coefficient.placement[axis] || coefficient.walls ||
      is_in_a_boundary(problem, coefficient.name))
    return false;
  return std::ranges::any_of(boundaries_of(problem), [&](const std::vector<AxisSides>* boundary) {
    if (axis >= boundary->size()) return false;
    const AxisSides& sides = (*boundary)[axis];
    return condition_of((is_low ? sides.low : sides.high).kind).has_slope();
  });
}

}  // namespace dpde::model
