// SPDX-License-Identifier: Apache-2.0
// Adjoints given with a kernel: the derived adjoint on periodic axes in another form, or a wrong one.
#pragma once

#include "stencil/stencil.h"
#include "support/split_mix.h"

namespace dpde::testing {

/// Gives `kernel` an adjoint of one of its inputs, where there is a formula for one. A wrong one is the right one,
/// scaled.
void give_adjoint(stencil::Kernel& kernel, SplitMix& random, bool is_wrong);

}  // namespace dpde::testing
