// SPDX-License-Identifier: Apache-2.0
// Second derivatives in losses, tests and observables next to walls with values. The ghost value 2a - u_0 is the value
// u_0 of the first cell mirrored at the wall value a; with it equations are of order 2 as a whole. Its error is h^2
// u''/4, so (u_1 - 2 u_0 + ghost)/h^2 in the first cell is 3/4 of u'', even on the finest grid.
#include <algorithm>
#include <variant>

#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

/// Walls with a value halfway between points of the state: "x.low, x.high"; "" if there are none.
std::string walls_with_values(const Problem& problem, const State& state) {
  std::string walls;
  const auto add = [&](const std::string& wall) { walls += (walls.empty() ? "" : ", ") + wall; };
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    if (problem.axes[axis].topology == Topology::periodic || state.placement[axis]) continue;
    const AxisSides& sides = state.boundary[axis];
    if (condition_of(sides.low.kind).gives_value()) add(problem.axes[axis].name + ".low");
    if (condition_of(sides.high.kind).gives_value()) add(problem.axes[axis].name + ".high");
  }
  return walls;
}

/// Ignores forces on masks: these use the right-hand sides exactly as the step does.
bool holds_second(const Elaboration& elaboration, const Expr& e, const std::string& state) {
  const auto* reduce = as<Reduce>(e);
  const auto is_it = [&](const auto& force) {
    const auto* moment = as<Binary>(reduce->operand);
    return force.second.rate == reduce->operand || (moment && moment->right == force.second.rate);
  };
  if (reduce && std::ranges::any_of(elaboration.masks.forces, is_it)) return false;
  if (is<Derivative>(e) && reads(e, state) && nested_order(e) >= 2) return true;
  return any_child(e, [&](const Expr& part) { return holds_second(elaboration, part, state); });
}

void check(Elaboration& elaboration, const Expr& value, const Origin& origin, const char* hint) {
  for (const State& state : elaboration.problem.states) {
    const std::string walls = walls_with_values(elaboration.problem, state);
    if (walls.empty() || !holds_second(elaboration, value, state.name)) continue;
    elaboration.sink.report("second-derivative-beside-wall", origin.range, {state.name, walls}, hint);
  }
}

}  // namespace

void check_wall_derivatives(Elaboration& elaboration) {
  for_each_formula(elaboration.problem, [&](const Use& use) {
    switch (time_of(use.kind)) {
      case UseTime::result:
        return check(elaboration, use.formula, use.origin,
                     use.kind == UseKind::output ? "leave out the cells next to the wall where that matters"
                                                 : "where that matters, weight the cells next to the wall by 0");
      case UseTime::step:  // equations are of order 2 as a whole
      case UseTime::field:
      case UseTime::boundary:
      case UseTime::geometry:
      case UseTime::never: return;
    }
  });
}

}  // namespace dpde::model
