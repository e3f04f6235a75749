// SPDX-License-Identifier: Apache-2.0
// Checks data of one time that are compared with a state at another time.
#include <fmt/format.h>

#include <cmath>

#include "model/build.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

double end_of(const Problem& problem) { return problem.t_begin + problem.steps * problem.step; }

/// The single time of the datum; nullopt if it has several, or a file determines it.
std::optional<double> time_of(const Problem& problem, const Datum& datum) {
  if (datum.when.kind == When::Kind::at && datum.when.times.size() == 1) return datum.when.times.front();
  const bool is_last_state = datum.when.kind == When::Kind::end && !datum.scene.empty();
  return is_last_state ? std::optional(end_of(problem)) : std::nullopt;
}

std::vector<double> times_of(const Problem& problem, const When& when) {
  if (when.kind == When::Kind::end) return {end_of(problem)};
  return when.kind == When::Kind::at ? when.times
                                     : std::vector<double>{};  // over time, one datum is a target for all states
}

void check_times(Elaboration& elaboration, const Expr& value, const When& when, const Origin& origin) {
  const Problem& problem = elaboration.problem;
  for (const Datum& datum : problem.task->data) {
    const std::optional<double> own = time_of(problem, datum);
    // a datum at the beginning is a formula or a file: a pattern to compare with at any time
    if (!own || !reads(value, datum.name) || std::abs(*own - problem.t_begin) <= 1e-6 * problem.step) continue;
    for (const double t : times_of(problem, when)) {
      if (std::abs(t - *own) <= 1e-6 * problem.step) continue;
      elaboration.sink.report(
          "data-of-other-time", origin.range, {datum.name, fmt::format("{:.10g}", *own), fmt::format("{:.10g}", t)},
          fmt::format(
              "write at t = {:.10g} here, or at t = {:.10g} after the data; a goal for another time stays as it is",
              *own, t));
      return;  // reported once, not for each component
    }
  }
}

}  // namespace

void check_data_times(Elaboration& elaboration) {
  if (!elaboration.problem.task || learns_from_trajectories(elaboration)) return;
  for (const Loss& loss : elaboration.problem.task->losses)
    check_times(elaboration, loss.value, loss.when, loss.origin);
  for (const Test& test : elaboration.problem.task->tests)
    check_times(elaboration, test.quantity.value, test.when, test.quantity.origin);
}

}  // namespace dpde::model
