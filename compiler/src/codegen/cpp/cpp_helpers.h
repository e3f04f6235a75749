// SPDX-License-Identifier: Apache-2.0
// Small helper functions in the emitted file, each only if the module uses it.
#pragma once

#include <string>
#include <string_view>

#include "loop/loop.h"

namespace dpde::codegen {

/// Definitions of dpde_min, dpde_max, dpde_sign, dpde_fraction, dpde_inside and of interpolation, each only if `module`
/// uses it; may be "".
std::string cpp_helpers(const loop::Module& module);

/// Name of the helper that returns the cells and weights along an axis.
std::string_view cpp_taps(InterpolationBasis along);

/// Whether the module calls a function of <math.h>. Parsing that header takes longer than compiling a small module.
bool needs_math(const loop::Module& module);

}  // namespace dpde::codegen
