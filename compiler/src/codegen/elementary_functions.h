// SPDX-License-Identifier: Apache-2.0
// Which functions the back ends take from dpde/elementary.h in cells. Uniforms, each computed once, take the C
// library's.
#pragma once

#include "support/vocabulary.h"

namespace dpde::codegen {

/// sin, exp, ...: no instruction of processors. (Beside them: powers that are not written as products.)
bool is_elementary(Fn fn);

}  // namespace dpde::codegen
