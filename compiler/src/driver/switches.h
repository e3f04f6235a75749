// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches: what has no derivative of use is an error before anything is differentiated.
#pragma once

#include "driver/pipeline.h"

namespace dpde::driver {

/// Errors at unknowns that only move switches, and at choices that jump where unknowns or states of the task move their
/// switch: those of formulas, and the first one of a hand-written step. Jumps of schemes, as at the bounds of
/// maccormack, do not count. With options.takes_jumps they are no errors, and are kept in compiled.jumps_left_out. Of a
/// scene without a task, whose parameters are all unknown, those that make switches jump are none afterwards.
void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink);

/// The program of the divisors whose signs the derivatives take for granted, which compiled.divisors then are. With
/// options.trusts_signs nothing looks at them.
stencil::Module follow_divisors(Compiled& compiled, const CompileOptions& options);

/// Whether something jumps, or would where a field that is divided by came to another sign, as none should.
bool may_jump(const Compiled& compiled);

/// Errors at the jumps that are left out, as a gradient has them that is not forced.
void report_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// Warnings at them, for who goes on without them.
void warn_of_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// And at quotients that may be jumps, as no run looks at the signs of what divides.
void warn_of_unwatched(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
