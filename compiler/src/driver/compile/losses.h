// SPDX-License-Identifier: Apache-2.0
// What the losses of a task have to have for what is asked of them.
#pragma once

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// The task's optimiser where that is Newton's method, else null.
const model::Optimiser* newton_of(const Compiled& compiled);

/// After differentiation: errors at losses that depend on nothing that varies, and at those without the squares that a
/// Gauss-Newton matrix needs.
void check_losses(const Compiled& compiled, DiagnosticSink& sink);

}  // namespace dpde::driver
