// SPDX-License-Identifier: Apache-2.0
// Whether what was differentiated has kinks where unknowns move: abs, max, if, floor, interpolation at computed places,
// layers that bend.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::analysis {

/// Of the programs that have derivatives. They may jump there too.
bool has_kinks(const driver::Compiled& compiled);

/// Whether formulas or a hand-written step of the task jump where its unknowns or states move a switch, and derivatives
/// go on without that.
bool has_jumps(const driver::Compiled& compiled);

}  // namespace dpde::analysis
