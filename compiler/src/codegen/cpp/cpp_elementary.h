// SPDX-License-Identifier: Apache-2.0
// sin, exp, pow, ... in the rows of emitted C++: the functions of dpde/elementary_cells.h, under the names that g++'s
// vectoriser looks for.
#pragma once

#include <string>

#include "loop/loop.h"

namespace dpde::codegen {

/// Prefix of the names of these functions.
std::string cpp_elementary_prefix();

/// Definitions of the functions that the module's rows call; "" if there are none.
std::string cpp_elementary(const loop::Module& module);

}  // namespace dpde::codegen
