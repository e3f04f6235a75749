// SPDX-License-Identifier: Apache-2.0
// Reports boundary values and slopes that are not finite, if known before the run: formulas of numbers, parameters with
// values, coordinates and t.
#include <fmt/format.h>

#include <cmath>

#include "model/analyse/formula.h"
#include "model/analyse/solves.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

class BoundaryValues {
 public:
  explicit BoundaryValues(Elaboration& elaboration) : elaboration_(elaboration) {}

  void look_at(const std::string& field, const std::vector<AxisSides>& boundary, SourceRange range) {
    for (std::size_t axis = 0; axis < boundary.size(); ++axis) {
      if (elaboration_.problem.axes[axis].topology == Topology::periodic) continue;
      for (const bool is_low : {true, false}) {
        const Side& side = is_low ? boundary[axis].low : boundary[axis].high;
        for (const Expr* value : {&side.value, &side.a, &side.b}) {
          if (look_at(field, *value, {axis, is_low}, range)) break;
        }
      }
    }
  }

 private:
  struct Wall {
    std::size_t axis;
    bool is_low;
  };

  /// A value that is infinite only at t = 0 is left to the run, as a scheme may not evaluate it there.
  bool look_at(const std::string& field, const Expr& value, const Wall& wall, SourceRange range) {
    const Problem& problem = elaboration_.problem;
    const std::optional<double> first = not_finite(value, wall, problem.t_begin);
    if (!first || !not_finite(value, wall, problem.t_begin + problem.step)) return false;
    const std::string side = wall.is_low ? ".low" : ".high";
    const SourceRange own = boundary_of_side(elaboration_, field, problem.axes[wall.axis].name + side).value_or(range);
    elaboration_.sink.report(
        "boundary-not-finite", own,
        {field, written_axis(elaboration_, wall.axis) + side, fmt::format("{}", dpde::shown(*first))},
        "a formula divides by 0 there, or takes a root or log of a number that has none");
    return true;
  }

  /// The first non-finite value along the wall; nullopt if all are finite or unknown.
  std::optional<double> not_finite(const Expr& value, const Wall& wall, double t) const {
    KnownValues values = elaboration_.params.values;
    values["t"] = t;
    const Expr formula = with_known(value, values);
    if (!is_formula(formula)) return std::nullopt;
    const std::vector<Axis>& axes = elaboration_.problem.axes;
    std::array<int, 3> cells{1, 1, 1};
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (a != wall.axis && depends_on_axis(formula, static_cast<int>(a))) cells[a] = axes[a].cells;
    }
    for (int i = 0; i < cells[0] * cells[1] * cells[2]; ++i) {
      const std::array<int, 3> cell{i % cells[0], i / cells[0] % cells[1], i / cells[0] / cells[1]};
      std::array<double, 3> place{};
      for (std::size_t a = 0; a < axes.size(); ++a) place[a] = axes[a].centre(cell[a]);
      place[wall.axis] = wall.is_low ? axes[wall.axis].low : axes[wall.axis].high;
      const double there = value_at(formula, place);
      if (!std::isfinite(there)) return there;
    }
    return std::nullopt;
  }

  Elaboration& elaboration_;
};

}  // namespace

void check_boundary_values(Elaboration& elaboration) {
  BoundaryValues values(elaboration);
  for (const State& state : elaboration.problem.states) {
    if (state.history_of.empty() && state.velocity_of.empty())
      values.look_at(state.name, state.boundary, state.origin.range);
  }
  for (const Solve* solve : solves_of(elaboration.problem))
    values.look_at(solve->name, solve->boundary, solve->operation->origin.range);
}

}  // namespace dpde::model
