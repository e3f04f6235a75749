// SPDX-License-Identifier: Apache-2.0
// The functions that back ends take from dpde/elementary.h in rows. Uniforms are computed once and use the C library.
#pragma once

#include "support/vocabulary.h"

namespace dpde::codegen {

/// Whether it is sin, exp, ...: a function without a processor instruction. (Also elementary: powers not written as
/// products.)
bool is_elementary(Fn fn);

}  // namespace dpde::codegen
