// SPDX-License-Identifier: Apache-2.0
// Loop level -> one self-contained C++ file for people and compilers: every row is a plain loop in a function of its
// own, with the names of the source, and an extern "C" wrapper that unpacks dpde_row.
#pragma once

#include <string>

#include "loop/loop.h"
#include "source/source_file.h"

namespace dpde::codegen {

/// Whether others can link to the rows, or they are known inside the file alone.
enum class RowLinkage { exported, within_the_file };

/// Symbols: dpde_compute_uniforms and symbol_of(row) for each row. With `source`, stores show the line they come from.
std::string emit_cpp(const loop::Module& module, const SourceFile* source = nullptr,
                     RowLinkage linkage = RowLinkage::exported);

/// Name of the extern "C" function of a row.
std::string symbol_of(const std::string& row);

}  // namespace dpde::codegen
