// SPDX-License-Identifier: Apache-2.0
// Boundary values and slopes that are formulas of fields. They are computed from the state at the beginning of a stage.
// They cannot be combined with schemes that are implicit in the state at the end of a stage, or that need boundary
// values at another time.
#include <fmt/format.h>

#include "model/analyse/solves.h"
#include "model/boundary/wall_formula.h"
#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

class WallFormula {
 public:
  WallFormula(Elaboration& elaboration, const State& state, std::size_t axis, bool is_low)
      : elaboration_(elaboration), state_(state), index_(axis), axis_(elaboration.problem.axes[axis]), is_low_(is_low) {
    place_ = axis_.name + (is_low ? ".low" : ".high");
    range_ = boundary_of_side(elaboration, state.name, place_).value_or(state.origin.range);
  }

  void check(const Side& side) {
    if (!is_of_states(elaboration_.problem, side)) return;
    if (state_.placement != Placement{}) {
      refuse(fmt::format("the boundary of {}, which lies on faces", state_.name),
             "formulas of fields hold for fields at cell centres");
      return;
    }
    check_scheme();
    for_each_field(side.value);
  }

 private:
  void refuse(std::string where, std::string hint) {
    elaboration_.sink.report("not-allowed-here", range_, {"a formula of fields", std::move(where)}, std::move(hint));
  }

  void check_scheme() {
    const Scheme& scheme = elaboration_.problem.scheme;
    if (is_leapfrog(scheme.time) || is_implicit(scheme.time) || is_exponential(scheme.time))
      elaboration_.sink.report("schemes-do-not-fit", range_, {print(scheme.time), "a formula of fields at a wall"},
                               "take time = rk4 or ssp_rk3");
    else if (scheme.is_split())
      refuse("the boundary of a scene whose steps are split", "leave out split");
    else if (scheme.is_semi_lagrangian())
      refuse("the boundary of a scene with semi-Lagrangian advection", "take advect = upwind(3) or weno(5)");
    else if (state_.parts > 1)
      refuse("the boundary of a scene with subcycle", "make all steps shorter");
  }

  void for_each_field(const Expr& e) {
    if (const auto* field = as<Field>(e)) {
      if (const State* read = elaboration_.problem.find_state(field->name)) check_place(*read);
      return;
    }
    for_each_child(e, [&](const Expr& part) { for_each_field(part); });
  }

  /// Allowed: cell centres, or points on the wall that are stored in arrays and complete without a fill.
  void check_place(const State& read) {
    if (read.placement == Placement{}) return;
    Placement across{};
    across[index_] = true;
    if (read.placement != across) {
      refuse(fmt::format("the boundary at {}, where {} is not known", place_, read.name),
             fmt::format("it takes fields at cell centres and those on faces across {}", axis_.name));
      return;
    }
    const AxisSides& sides = read.boundary[index_];
    const SideCondition& condition = condition_of((is_low_ ? sides.low : sides.high).kind);
    if (!axis_.holds_wall(is_low_)) {
      refuse(fmt::format("the boundary at {}, where the arrays of {} hold no value", place_, read.name),
             fmt::format("let the axis end there: grid {} = {} .. {}", axis_.name, is_low_ ? axis_.high : axis_.low,
                         is_low_ ? axis_.low : axis_.high));
    } else if (!condition.gives_value() && !condition.keeps_wall()) {
      refuse(fmt::format("the boundary at {}, where {} follows from its slope", place_, read.name),
             fmt::format("give {} a value there, or outflow", read.name));
    }
  }

  Elaboration& elaboration_;
  const State& state_;
  std::size_t index_;
  const Axis& axis_;
  bool is_low_;
  std::string place_;
  SourceRange range_;
};

}  // namespace

void check_wall_formulas(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  for (const State& state : problem.states) {
    if (!state.history_of.empty() || !state.velocity_of.empty()) continue;  // their sides are those of other states
    for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
      if (problem.axes[axis].topology == Topology::periodic) continue;
      WallFormula(elaboration, state, axis, true).check(state.boundary[axis].low);
      WallFormula(elaboration, state, axis, false).check(state.boundary[axis].high);
    }
  }
  for (const Solve* solve : solves_of(problem)) {
    const auto report = [&](const std::string& where) {
      elaboration.sink.report("not-allowed-here", solve->operation->origin.range,
                              {"a formula of fields at a wall", where},
                              "give it a value or a slope of numbers, parameters, coordinates, t and coefficients");
    };
    if (has_wall_formula(problem, solve->boundary)) report(fmt::format("the boundary of {}", solve->name));
    for (const State& state : problem.states) {
      if (has_wall_formula(problem, state.boundary) && reads(solve->operation, state.name))
        report(fmt::format("the boundary of {}, which the equation for {} has as a factor", state.name, solve->name));
    }
  }
}

}  // namespace dpde::model
