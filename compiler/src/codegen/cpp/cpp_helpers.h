// SPDX-License-Identifier: Apache-2.0
// Small functions the emitted file carries along, each only where the module needs it.
#pragma once

#include <string>
#include <string_view>

#include "loop/loop.h"

namespace dpde::codegen {

/// Definitions of dpde_min, dpde_max, dpde_sign, dpde_fraction, dpde_inside and of interpolation for what `module`
/// uses; may be "".
std::string cpp_helpers(const loop::Module& module);

/// The one of them that gives the cells and weights along an axis.
std::string_view cpp_taps(InterpolationBasis along);

/// Whether the module calls a function of <math.h>; reading that header takes the compiler longer than a small module.
bool needs_math(const loop::Module& module);

}  // namespace dpde::codegen
