// SPDX-License-Identifier: Apache-2.0
// Checks that the losses of a task have the derivatives that the task needs.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// The task's optimiser if it is Newton's method, else null.
const model::Optimiser* newton_of(const Compiled& compiled);

/// Run after differentiation. Reports losses that depend on no unknown, and losses that are not sums of squares if a
/// Gauss-Newton matrix is needed.
void check_losses(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
