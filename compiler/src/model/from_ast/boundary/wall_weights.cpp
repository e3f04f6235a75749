// SPDX-License-Identifier: Apache-2.0
// Checks the weights of conditions at walls for all values known before the run: those of the scene, and the initial
// values of unknowns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "model/boundary/wall_image.h"
#include "model/build.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// A ghost value for which the spacing has to be less than `factor`*|b/a|.
struct Coarsest {
  int ghost = 0;  // 1: next to the side
  double factor = std::numeric_limits<double>::infinity();
  std::string text;  // of the factor
};

/// a*u + b*du/dn = c gives the ghost value the factor a*p + b*q/h, positive for small h; for that of cell k this is
/// a*(2k - 1) + 2b/h. With a and b of opposite signs it vanishes at h = q/p*|b/a|, and the ghost value of a coarser
/// cell has the wrong sign. This is the ghost value among the first `ghosts` for which that is the smallest spacing.
Coarsest coarsest(const GhostRule& rule, int cells, int ghosts) {
  Coarsest result;
  for (int k = 0; k < ghosts; ++k) {
    const bool is_wall = rule.on_walls && k == 0;
    const int way = rule.on_walls ? 2 * k : 2 * k + 1;
    const auto& [of_a, of_b] = (is_wall ? rule.wall : rule.beyond).on(cells).terms;
    const double p = of_a.ghost.at(way), q = of_b.ghost.at(way), factor = q / p;
    const bool is_short = std::floor(10 * factor) == 10 * factor;
    if (factor < result.factor)
      result = {k + 1, factor, is_short ? fmt::format("{}", factor) : fmt::format("{}/{}", q, p)};
  }
  return result;
}

std::optional<WallMisfit> misfit_at(const Problem& problem, const WeightedSide& side, double a, double b, int ghosts,
                                    const std::string& when) {
  if (a == 0 && b == 0)
    return WallMisfit{true, fmt::format("{} at {}{}", side.field, side.side, when), "",
                      "mixed(a, b, c) is a*u + b*du/dn = c: a or b has to differ from 0 at each time of the run"};
  if (!(a * b < 0)) return std::nullopt;
  const State* state = problem.find_state(side.field);
  const bool on_wall = state && state->placement[static_cast<std::size_t>(side.axis)];
  const Axis& along = problem.axes[static_cast<std::size_t>(side.axis)];
  const auto [ghost, factor, text] =
      coarsest(condition_of(SideKind::mixed).rule(on_wall), along.cells, std::max(ghosts, 1));
  const double h = along.spacing(), limit = factor * std::abs(b / a);
  if (h < limit * (1 - 1e-9)) return std::nullopt;
  const std::string what = ghost > 1 ? fmt::format("for ghost value {} from the wall outwards ", ghost) : "";
  return WallMisfit{
      false, fmt::format("mixed({:.10g}, {:.10g}, ...) of {}{}", a, b, side.field, when),
      fmt::format("a and b have opposite signs, and {}the spacing {:.10g} along {} is not below {}*|b/a| = "
                  "{:.10g}",
                  what, h, along.name, text, limit),
      fmt::format("take more than {:.0f} cells{}, or check the signs: du/dn is the derivative outwards, "
                  "so that u decays inwards where a and b have the same sign",
                  std::floor((along.high - along.low) / limit * (1 + 1e-9)),
                  ghost > 1 ? " or a scheme that reads fewer ghost values" : "")};
}

/// Whether it contains an unknown parameter.
bool may_change(const Problem& problem, const Expr& e) {
  return any_part(e, [&](const Expr& part) {
    const Param* param = as<Param>(part);
    const Parameter* parameter = param ? problem.find_param(param->name) : nullptr;
    return parameter && parameter->unknown;
  });
}

SourceRange position_of(const Side& side, const State& state) {
  for (const Expr& weight : {side.a, side.b}) {
    if (weight->origin.range.is_known()) return weight->origin.range;
  }
  return state.origin.range;
}

}  // namespace

void report(const WallMisfit& misfit, const std::string& when, SourceRange range, DiagnosticSink& sink) {
  if (misfit.is_empty) {
    sink.report("empty-condition", range, {misfit.condition + when}, misfit.hint);
  } else {
    sink.report("condition-too-coarse", range, {misfit.condition + when, misfit.reason}, misfit.hint);
  }
}

std::optional<WallMisfit> misfit_of_wall(const Problem& problem, const WeightedSide& side, KnownValues values,
                                         int ghosts) {
  const bool varies = holds_time(side.a) || holds_time(side.b);
  for (const double t : varies ? times_of_run(problem) : std::vector{problem.t_begin}) {
    values["t"] = t;
    const std::optional<double> a = known_value(side.a, values), b = known_value(side.b, values);
    if (!a || !b) continue;
    const auto misfit = misfit_at(problem, side, *a, *b, ghosts, varies ? fmt::format(" at t = {:.6g}", t) : "");
    if (misfit) return misfit;
  }
  return std::nullopt;
}

/// On stretched axes weights, cells and spacings are those of the uniform coordinate.
std::optional<WallMisfitAt> misfit_of_walls(const Problem& problem, const KnownValues& values,
                                            const GhostCounts& ghosts, Walls which) {
  for (const State& state : problem.states) {
    const auto counts = ghosts.find(state.name);
    for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
      const Axis& across = problem.axes[axis];
      if (across.topology == Topology::periodic) continue;
      for (const bool is_low : {true, false}) {
        const Side& side = is_low ? state.boundary[axis].low : state.boundary[axis].high;
        if (side.kind != SideKind::mixed) continue;
        if (which == Walls::with_unknowns && !may_change(problem, side.a) && !may_change(problem, side.b)) continue;
        const int of_wall = state.placement[axis] && !is_low ? 1 : 0;  // the last value along the axis, a ghost too
        const int count = (counts == ghosts.end() ? 0 : counts->second[axis]) + of_wall;
        const auto misfit = misfit_of_wall(
            problem, {state.name, static_cast<int>(axis), side_name(across, is_low), side.a, side.b}, values, count);
        if (misfit) return WallMisfitAt{*misfit, position_of(side, state)};
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
