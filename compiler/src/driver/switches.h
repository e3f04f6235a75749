// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches: what has no derivative of use is an error before anything is differentiated.
#pragma once

#include "driver/pipeline.h"

namespace dpde::driver {

/// Errors at unknowns that only move switches, and, unless options.takes_jumps, at choices that jump where they switch.
/// Of a scene without a task, whose parameters are all unknown, those that make switches jump are none afterwards.
void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink);

}  // namespace dpde::driver
