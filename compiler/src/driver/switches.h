// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches: what has no derivative of use is an error before anything is differentiated.
#pragma once

#include <vector>

#include "driver/pipeline.h"
#include "model/switches.h"

namespace dpde::driver {

/// Choices that jump where unknowns or states of the task move their switch: those of formulas, and the first one of a
/// hand-written step. Jumps of schemes, as at the bounds of maccormack, do not count.
std::vector<model::Jump> jumps_of(const Compiled& compiled);

/// Errors at all of them, as a gradient has them that is not forced.
void report_jumps(const Compiled& compiled, DiagnosticSink& sink);

/// Errors at unknowns that only move switches, and, unless options.takes_jumps, at choices that jump where they switch.
/// Of a scene without a task, whose parameters are all unknown, those that make switches jump are none afterwards.
void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink);

}  // namespace dpde::driver
