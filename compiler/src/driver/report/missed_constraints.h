// SPDX-License-Identifier: Apache-2.0
// Constraints that do not hold after a step.
#pragma once

#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Tolerated error relative to the constraint's terms: solves end at 1e-10 of their right-hand sides.
double rounding_of_constraints(const Session& session);

/// Warns of each constraint whose error exceeds rounding. Typically, walls let in more than they let out, and no
/// pressure removes the remaining mean divergence.
void report_missed_constraints(const Session& session, const std::vector<Session::Miss>& misses, DiagnosticSink& sink);

}  // namespace dpde::driver
