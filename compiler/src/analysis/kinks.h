// SPDX-License-Identifier: Apache-2.0
// Whether differentiated programs have kinks that unknowns move: abs, max, if, floor, interpolation at displaced
// positions, activations with kinks.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::analysis {

/// For all programs with derivatives. They may also jump there.
bool has_kinks(const driver::Compiled& compiled);

/// Whether the task's formulas or a hand-written step jump when its unknowns or states move a switch, and derivatives
/// ignore that.
bool has_jumps(const driver::Compiled& compiled);

}  // namespace dpde::analysis
