// SPDX-License-Identifier: Apache-2.0
// Constraints that are not true behind a step.
#pragma once

#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Of the terms of a constraint: solves end at 1e-10 of their right sides.
double rounding_of_constraints(const Session& session);

/// A warning for each that misses by more than rounding: walls that let in more than they let out leave a mean that no
/// pressure takes away.
void report_missed_constraints(const Session& session, const std::vector<Session::Miss>& misses, DiagnosticSink& sink);

}  // namespace dpde::driver
