// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "stencil/stencil.h"
#include "support/split_mix.h"

namespace dpde::testing {

/// The whole program as the block of a repeat, which may count its passes. What it carries is brought back to where
/// inputs lie: a power of a power of a power would be anything. Programs that carry nothing stay as they are.
void repeat_it(stencil::Module& module, stencil::Program& program, SplitMix& random);

}  // namespace dpde::testing
