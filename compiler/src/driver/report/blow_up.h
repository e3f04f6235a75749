// SPDX-License-Identifier: Apache-2.0
// Runs that leave all bounds: those that end with values that are not finite, and those that would.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dpde/runtime/growth.h"
#include "driver/scene/session.h"

namespace dpde::driver {

/// The states that ended the last run `suspicious` times above where they began, and go on so.
std::vector<Growth> instabilities_of(Session& session, double suspicious = 1e8);
/// What may help, "" where nothing is known: asked for only where a run needs it.
using Advice = std::function<std::string(Session& session)>;
/// A warning for each, at the equation of the field.
void report_instabilities(Session& session, DiagnosticSink& sink, const Advice& advice = {});

/// A blown-up run in the user's words, at the equation of the field. `advice` is what may help; "": a smaller step.
void report_blow_up(Session& session, const BlowUp& blow_up, DiagnosticSink& sink, const std::string& advice = "");

/// An error of a run until steady that came to its last step before.
void report_not_steady(const Session& session, const RunResult& run, DiagnosticSink& sink);

}  // namespace dpde::driver
