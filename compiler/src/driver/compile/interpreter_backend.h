// SPDX-License-Identifier: Apache-2.0
// The reference interpreter as a back end: slow, but it defines the results of all others.
#pragma once

#include <memory>

#include "codegen/compiled_module.h"
#include "loop/loop.h"
#include "stencil/stencil.h"

namespace dpde::driver {

/// Module whose programs run stencil::interpret on copies of the fields. `loop` must be made from `stencil`.
std::shared_ptr<codegen::CompiledModule> interpreted(const stencil::Module& stencil, const loop::Module& loop);

}  // namespace dpde::driver
