// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches. Derivatives that are useless for this reason are reported before differentiation.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Reports unknowns that only move switches, and choices that jump where unknowns or states of the task move their
/// switch: all in formulas, and the first in a hand-written step. Jumps of schemes, as at the bounds of maccormack, do
/// not count. With options.takes_jumps they are stored in compiled.jumps_left_out instead. Jumps whose effect only a
/// run can show are left to watch_jumps(). In a scene without a task all parameters are unknowns; those that make
/// switches jump are removed.
void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink);

/// Fills compiled.watched and returns the programs that evaluate it, for gradients to check: choices and signs that are
/// on one side at the start of the run, as far as formulas show, and divisors whose signs the derivatives rely on.
/// Empty with options.trusts_signs.
std::vector<stencil::Module> watch_jumps(Compiled& compiled, const CompileOptions& options);

/// Whether something jumps, or would if a divisor field changed its sign, which none should.
bool may_jump(const Compiled& compiled);

/// Errors at the jumps that were left out, for a gradient without --force.
void report_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// Warnings at these jumps, for a gradient with --force.
void warn_of_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink);

/// Warnings at divisors in solves and kernels, which no run checks.
void warn_of_unwatched(const Compiled& compiled, DiagnosticSink& sink);

/// Warnings at choices that runs check.
void warn_of_watched(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
