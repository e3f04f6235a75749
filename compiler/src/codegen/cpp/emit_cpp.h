// SPDX-License-Identifier: Apache-2.0
// Loop level -> one self-contained, readable C++ file. Every row is a plain loop in its own function, with the names of
// the model, and an extern "C" wrapper that unpacks dpde_row.
#pragma once

#include <string>

#include "loop/loop.h"
#include "source/source_file.h"

namespace dpde::codegen {

/// Whether rows have external linkage or are local to the file.
enum class RowLinkage { exported, within_the_file };

/// Defines the symbols dpde_compute_uniforms and symbol_of(row) for each row. With `source`, comments at stores name
/// the source line.
std::string emit_cpp(const loop::Module& module, const SourceFile* source = nullptr,
                     RowLinkage linkage = RowLinkage::exported);

/// Name of the extern "C" function of a row.
std::string symbol_of(const std::string& row);

}  // namespace dpde::codegen
