// SPDX-License-Identifier: Apache-2.0
// Checks positions that depend on t or an unknown, for all values known before the run. (During a search a position
// beyond a wall is moved to the wall.)
#include <fmt/format.h>

#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Where the position is outside the grid: "x = 1.25 at t = 0.9"; nullopt if it is inside, as far as known.
std::optional<std::string> leaves_grid(const Problem& problem, const OpenPlace& place, KnownValues values) {
  for (std::size_t axis = 0; axis < place.position.size(); ++axis) {
    const Axis& grid = problem.axes[axis];
    const bool varies = holds_time(place.position[axis]);
    if (grid.topology == Topology::periodic || grid.stretch)
      continue;  // periodic axes wrap; stretched axes already use another coordinate here
    for (const double t : varies ? times_of_run(problem) : std::vector{problem.t_begin}) {
      values["t"] = t;
      const std::optional<double> at = known_value(place.position[axis], values);
      const double rounding = 1e-9 * (grid.high - grid.low);
      if (!at || (*at >= grid.low - rounding && *at <= grid.high + rounding)) continue;
      return fmt::format("{} = {:.6g}{}", grid.name, *at, varies ? fmt::format(" at t = {:.6g}", t) : "");
    }
  }
  return std::nullopt;
}

}  // namespace

void check_open_places(Elaboration& elaboration) {
  for (const OpenPlace& place : elaboration.open_places) {
    std::string when;
    std::optional<std::string> outside = leaves_grid(elaboration.problem, place, elaboration.params.values);
    if (!outside && elaboration.problem.task) {
      when = fmt::format(" where task {} begins", elaboration.problem.task->name);
      outside = leaves_grid(elaboration.problem, place, values_at_start(elaboration));
    }
    if (!outside) continue;
    elaboration.sink.report("outside-the-grid", place.range, {place.callee, *outside + when},
                            "where it shall stay at a wall say so: at = min(max(x0 + t, 0), 1)");
  }
}

}  // namespace dpde::model
