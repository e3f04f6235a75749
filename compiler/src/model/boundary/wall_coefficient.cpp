// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/wall_coefficient.h"

#include <algorithm>

#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/uses.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

/// Of states and of unknowns of solves.
std::vector<const std::vector<AxisSides>*> boundaries_of(const Problem& problem) {
  std::vector<const std::vector<AxisSides>*> boundaries;
  for (const State& state : problem.states) boundaries.push_back(&state.boundary);
  for (const Solve* solve : solves_of(problem)) boundaries.push_back(&solve->boundary);
  return boundaries;
}

/// Whether the side takes the coefficient's value in the cell at the wall.
bool takes_cell(const Problem& problem, const Coefficient& coefficient, const Side& side, std::size_t axis) {
  const bool is_at_cell = condition_of(side.kind).takes_rate() || !is_led_to_walls(problem, coefficient, axis);
  return is_at_cell && reads(side.value, coefficient.name);
}

bool is_in_a_boundary(const Problem& problem, const Coefficient& coefficient) {
  return std::ranges::any_of(boundaries_of(problem), [&](const std::vector<AxisSides>* boundary) {
    for (std::size_t axis = 0; axis < boundary->size(); ++axis) {
      const AxisSides& sides = (*boundary)[axis];
      if (takes_cell(problem, coefficient, sides.low, axis) || takes_cell(problem, coefficient, sides.high, axis))
        return true;
    }
    return false;
  });
}

/// Whether steps read it as a field. Formulas of results do not affect steps.
bool is_in_steps(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step: return true;
    case UseTime::result:
    case UseTime::field:
    case UseTime::boundary:
    case UseTime::geometry:
    case UseTime::never: return false;
  }
  unreachable("time of a use");
}

bool is_in_an_equation(const Problem& problem, const std::string& coefficient) {
  return any_formula(problem, [&](const Use& use) { return is_in_steps(use.kind) && reads(use.formula, coefficient); });
}

}  // namespace

bool is_led_to_walls(const Problem& problem, const Coefficient& coefficient, std::size_t axis) {
  if (coefficient.placement[axis]) return false;
  const auto is_across = [&](const Expr& part) {
    const auto* coordinate = as<Coordinate>(part);
    return coordinate && static_cast<std::size_t>(coordinate->axis) == axis;
  };
  return is_in_an_equation(problem, coefficient.name) ||
         (coefficient.value.formula && any_part(*coefficient.value.formula, is_across));
}

bool goes_on_beyond(const Problem& problem, const Coefficient& coefficient, std::size_t axis, bool is_low) {
  if (problem.axes[axis].topology == Topology::periodic || coefficient.placement[axis] || coefficient.walls ||
      is_in_a_boundary(problem, coefficient))
    return false;
  return std::ranges::any_of(boundaries_of(problem), [&](const std::vector<AxisSides>* boundary) {
    if (axis >= boundary->size()) return false;
    const AxisSides& sides = (*boundary)[axis];
    return condition_of((is_low ? sides.low : sides.high).kind).has_slope();
  });
}

}  // namespace dpde::model
