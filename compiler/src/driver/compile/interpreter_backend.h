// SPDX-License-Identifier: Apache-2.0
// The reference interpreter as a back end: slow, but the definition of what the others must compute.
#pragma once

#include <memory>

#include "codegen/compiled_module.h"
#include "loop/loop.h"
#include "stencil/stencil.h"

namespace dpde::driver {

/// Programs whose `interpret` runs stencil::interpret on copies of the fields. `loop` is made from `stencil`.
std::shared_ptr<codegen::CompiledModule> interpreted(const stencil::Module& stencil, const loop::Module& loop);

}  // namespace dpde::driver
