// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/wall_formula.h"

#include <algorithm>

#include "model/build.h"

namespace dpde::model {

bool is_of_states(const Problem& problem, const Side& side) {
  return any_part(side.value, [&](const Expr& part) {
    const auto* field = as<Field>(part);
    return field && problem.find_state(field->name) != nullptr;
  });
}

bool has_wall_formula(const Problem& problem, const std::vector<AxisSides>& boundary) {
  return std::ranges::any_of(boundary, [&](const AxisSides& sides) {
    return is_of_states(problem, sides.low) || is_of_states(problem, sides.high);
  });
}

}  // namespace dpde::model
