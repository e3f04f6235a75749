// SPDX-License-Identifier: Apache-2.0
// sin, exp, pow, ... of cells in emitted C++: the functions of dpde/elementary_cells.h, under names that g++ finds when
// it vectorises a loop.
#pragma once

#include <string>

#include "loop/loop.h"

namespace dpde::codegen {

/// What the names of these functions begin with in rows.
std::string cpp_elementary_prefix();

/// Definitions of those that rows call; "" when there are none.
std::string cpp_elementary(const loop::Module& module);

}  // namespace dpde::codegen
