// SPDX-License-Identifier: Apache-2.0
// Unbounded runs: those that end with values that are not finite, and those that soon would.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dpde/runtime/growth.h"
#include "driver/scene/session.h"

namespace dpde::driver {

/// States that are more than `suspicious` times their start at the end of the last run, and still grow.
std::vector<Growth> instabilities_of(Session& session, double suspicious = 1e8);
/// Returns advice for a message, or "". Called only if a message needs it.
using Advice = std::function<std::string(Session& session)>;
/// Warns of each such state, at the equation of the field.
void report_instabilities(Session& session, DiagnosticSink& sink, const Advice& advice = {});

/// Reports a blown-up run at the equation of the field. `advice`: what may help; "" suggests a smaller step.
void report_blow_up(Session& session, const BlowUp& blow_up, DiagnosticSink& sink, const std::string& advice = "");

/// Reports a run until steady that reached its last step first.
void report_not_steady(const Session& session, const RunResult& run, DiagnosticSink& sink);

}  // namespace dpde::driver
