// SPDX-License-Identifier: Apache-2.0
// Unrolls repeats pass by pass, as a reference for the meaning of `repeat`.
#pragma once

#include "stencil/stencil.h"

namespace dpde::testing {

/// The module with the repeats of its program, none of them in another and without stacks, written out.
stencil::Module written_out(const stencil::Module& module, const std::string& program);

}  // namespace dpde::testing
