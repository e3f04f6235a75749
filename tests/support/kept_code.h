// SPDX-License-Identifier: Apache-2.0
// Machine code of this process, by all that it is made of: a test that opens a model on several grids, or with several
// numbers, compiles once what does not depend on them.
#pragma once

#include <memory>

#include "codegen/code_cache.h"

namespace dpde::testing {

std::shared_ptr<codegen::CodeCache> kept_code();

}  // namespace dpde::testing
