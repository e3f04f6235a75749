// SPDX-License-Identifier: Apache-2.0
// Conditions at walls that nothing reads. The equations say it: what each reads at its own points, once it is made of
// offsets.
#pragma once

#include "source/diagnostic.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// An error where a field on the wall would have read the condition, but has one of its own there; else a warning.
/// Conditions of slope 0 ask for nothing.
void check_idle_walls(const Lowering& lowering, DiagnosticSink& sink);

/// With zero_gradient in their places: what no equation reads neither jumps nor switches.
model::Problem without_idle_walls(const model::Problem& problem);

}  // namespace dpde::stencil
