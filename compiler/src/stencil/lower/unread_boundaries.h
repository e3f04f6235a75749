// SPDX-License-Identifier: Apache-2.0
// Boundary conditions that no equation reads, found from the reads of each discretised equation at its own points.
#pragma once

#include "source/diagnostic.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// Reports conditions that are not read: an error if the equation of a field on the wall would read the condition, but
/// the field has its own condition there; else a warning. Conditions of zero slope are not reported.
void check_idle_walls(const Lowering& lowering, DiagnosticSink& sink);

/// The problem with zero_gradient instead of conditions that are not read: they can neither jump nor switch.
model::Problem without_idle_walls(const model::Problem& problem);

}  // namespace dpde::stencil
