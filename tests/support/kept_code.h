// SPDX-License-Identifier: Apache-2.0
// Machine code of this process, by all its inputs: a test that opens a model on several grids, or with several numbers,
// compiles the parts that do not depend on them only once.
#pragma once

#include <memory>

#include "codegen/code_cache.h"

namespace dpde::testing {

std::shared_ptr<codegen::CodeCache> kept_code();

}  // namespace dpde::testing
