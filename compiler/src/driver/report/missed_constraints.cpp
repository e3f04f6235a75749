// SPDX-License-Identifier: Apache-2.0
#include "driver/report/missed_constraints.h"

#include <fmt/format.h>

#include <string>

namespace dpde::driver {

double rounding_of_constraints(const Session& session) {
  return session.problem().scheme.real == Precision::f32 ? 1e-3 : 1e-6;
}

void report_missed_constraints(const Session& session, const std::vector<Session::Miss>& misses, DiagnosticSink& sink) {
  const double rounding = rounding_of_constraints(session), tolerance = session.problem().scheme.solve.tolerance;
  for (const Session::Miss& miss : misses) {
    if (!(miss.value > rounding * miss.terms)) continue;
    const bool is_of_tolerance = tolerance > rounding && miss.value < 100 * tolerance * miss.terms;
    sink.report(
        "constraint-missed", miss.origin.range,
        {miss.multiplier, fmt::format("{:.3g}", miss.value), fmt::format("{:.3g}", miss.terms)},
        is_of_tolerance
            ? fmt::format("solves to {:g} of their right sides leave as much: take a smaller tolerance", tolerance)
            : std::string("the flow into a region between walls and masks has to leave it: = outflow lets "
                          "it out; a wall with inflow is no part of a mask; events that change the fields come after "
                          "the constraint"));
  }
}

}  // namespace dpde::driver
