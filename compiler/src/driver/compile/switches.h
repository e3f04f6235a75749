// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches: what has no derivative of use is an error before anything is differentiated.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Errors at unknowns that only move switches, and at choices that jump where unknowns or states of the task move their
/// switch: those of formulas, and the first one of a hand-written step. Jumps of schemes, as at the bounds of
/// maccormack, do not count. With options.takes_jumps they are no errors, and are kept in compiled.jumps_left_out. What
/// a run can tell from jumps that do not act in it is left to watch_jumps(). Of a scene without a task, whose
/// parameters are all unknown, those that make switches jump are none afterwards.
void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink);

/// The programs of what gradients look at in a run, compiled.watched afterwards: choices and signs that are on one side
/// where the run begins, as far as formulas tell, and divisors whose signs the derivatives take for granted. With
/// options.trusts_signs there is none.
std::vector<stencil::Module> watch_jumps(Compiled& compiled, const CompileOptions& options);

/// Whether something jumps, or would where a field that is divided by came to another sign, as none should.
bool may_jump(const Compiled& compiled);

/// Errors at the jumps that are left out, as a gradient has them that is not forced.
void report_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// Warnings at them, for who goes on without them.
void warn_of_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// And at what may change where no run looks: divisors in solves and kernels.
void warn_of_unwatched(const Compiled& compiled, DiagnosticSink& sink);

/// And at choices that are watched.
void warn_of_watched(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
