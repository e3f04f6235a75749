// SPDX-License-Identifier: Apache-2.0
// One row function as C++: a plain loop over the cells with one pointer for each stream, and a wrapper that unpacks
// dpde_row.
#pragma once

#include <string>

#include "loop/loop.h"
#include "source/source_file.h"

namespace dpde::codegen {

/// `linkage`: the words before the wrapper's name.
std::string emit_cpp_row(const loop::Module& module, const loop::Row& row, const SourceFile* source,
                         const std::string& linkage);

}  // namespace dpde::codegen
