// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: the IR of a whole module, verified, not yet bound to a processor.
#pragma once

#include <llvm/IR/Module.h>

#include <memory>
#include <string>

#include "loop/loop.h"

namespace dpde::codegen {

/// A row called like a function of the C library must not take its place, hence the prefix.
std::string row_symbol(const std::string& row);
/// void(const double* params, double* uniforms)
std::string uniforms_symbol();

std::unique_ptr<llvm::Module> emit_module(const loop::Module& module, llvm::LLVMContext& context);

/// Adds the function of one row (emit_row.cpp).
void emit_row(const loop::Module& module, const loop::Row& row, llvm::Module& out);

}  // namespace dpde::codegen
