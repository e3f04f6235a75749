// SPDX-License-Identifier: Apache-2.0
// Checks the weights of conditions at walls for all values known before the run: those of the scene, and the initial
// values of unknowns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "model/boundary/wall_image.h"
#include "model/build.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// a*u + b*du/dn = c gives the ghost value of u the factor a/2 + b/h, about b/h for small h. If a and b have opposite
/// signs and h is not small, the factor vanishes or changes sign, and the ghost value is meaningless.
std::optional<WallMisfit> misfit_at(const Problem& problem, const WeightedSide& side, double a, double b,
                                    const std::string& when) {
  if (a == 0 && b == 0)
    return WallMisfit{true, fmt::format("{} at {}{}", side.field, side.side, when), "",
                      "mixed(a, b, c) is a*u + b*du/dn = c: a or b has to differ from 0 at each time of the run"};
  if (!(a * b < 0)) return std::nullopt;
  const State* state = problem.find_state(side.field);
  const bool on_wall = state && state->placement[static_cast<std::size_t>(side.axis)];
  const Axis& along = problem.axes[static_cast<std::size_t>(side.axis)];
  const double h = along.spacing(), limit = on_wall ? 1.5 * std::abs(b / a) : 2 * std::abs(b / a);
  if (h < limit * (1 - 1e-9)) return std::nullopt;
  return WallMisfit{false, fmt::format("mixed({}, {}, ...) of {}{}", a, b, side.field, when),
                    fmt::format("a and b have opposite signs, and the spacing {} along {} is not below {}*|b/a| = {}",
                                h, along.name, on_wall ? 1.5 : 2, limit),
                    fmt::format("take more than {:.0f} cells, or check the signs: du/dn is the derivative outwards, so "
                                "that u decays inwards where a and b have the same sign",
                                std::floor((along.high - along.low) / limit))};
}

/// Whether it contains an unknown parameter.
bool may_change(const Problem& problem, const Expr& e) {
  return any_part(e, [&](const Expr& part) {
    const Param* param = std::get_if<Param>(&part->kind);
    const Parameter* parameter = param ? problem.find_param(param->name) : nullptr;
    return parameter && parameter->unknown;
  });
}

}  // namespace

void report(const WallMisfit& misfit, const std::string& when, SourceRange range, DiagnosticSink& sink) {
  if (misfit.is_empty) {
    sink.report("empty-condition", range, {misfit.condition + when}, misfit.hint);
  } else {
    sink.report("condition-too-coarse", range, {misfit.condition + when, misfit.reason}, misfit.hint);
  }
}

std::optional<WallMisfit> misfit_of_wall(const Problem& problem, const WeightedSide& side, KnownValues values) {
  const bool varies = holds_time(side.a) || holds_time(side.b);
  for (const double t : varies ? times_of_run(problem) : std::vector{problem.t_begin}) {
    values["t"] = t;
    const std::optional<double> a = known_value(side.a, values), b = known_value(side.b, values);
    if (!a || !b) continue;
    const auto misfit = misfit_at(problem, side, *a, *b, varies ? fmt::format(" at t = {:.6g}", t) : "");
    if (misfit) return misfit;
  }
  return std::nullopt;
}

/// On stretched axes the weights refer to the uniform coordinate; a = b = 0 is independent of the coordinate.
std::optional<WallMisfitAt> misfit_of_walls(const Problem& problem, const KnownValues& values) {
  for (const State& state : problem.states) {
    for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
      const Axis& across = problem.axes[axis];
      if (across.topology == Topology::periodic) continue;
      for (const bool is_low : {true, false}) {
        const Side& side = is_low ? state.boundary[axis].low : state.boundary[axis].high;
        if (!may_change(problem, side.a) && !may_change(problem, side.b)) continue;
        const SourceRange range = side.a->origin.range.is_known() ? side.a->origin.range : side.b->origin.range;
        const auto misfit = misfit_of_wall(
            problem, {state.name, static_cast<int>(axis), side_name(across, is_low), side.a, side.b, range}, values);
        if (misfit && (misfit->is_empty || !across.stretch)) return WallMisfitAt{*misfit, range};
      }
    }
  }
  return std::nullopt;
}

void check_wall_weights(Elaboration& elaboration) {
  std::set<int> told;  // beginnings of reported lines: one report per line, not per component and axis
  for (const WeightedSide& side : elaboration.weighted_sides) {
    if (told.contains(side.range.begin)) continue;
    std::string when;
    std::optional<WallMisfit> misfit = misfit_of_wall(elaboration.problem, side, elaboration.params.values);
    if (!misfit && elaboration.problem.task) {
      when = fmt::format(" where task {} begins", elaboration.problem.task->name);
      misfit = misfit_of_wall(elaboration.problem, side, values_at_start(elaboration));
    }
    if (!misfit) continue;
    told.insert(side.range.begin);
    report(*misfit, when, side.range, elaboration.sink);
  }
}

}  // namespace dpde::model
