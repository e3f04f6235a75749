// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: sin, exp, pow, ... as functions of the module. A row calls the function of one number, whose
// attribute names the functions of 2, 4, 8 or 16 numbers; the vectoriser calls those. All are made from
// dpde/elementary.h and give a cell the same bits.
#pragma once

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>

#include <string>
#include <vector>

namespace dpde::codegen {

/// Calls the function `name` ("pow" too) for one cell at the builder's position in a row. The first call also defines
/// the scalar function in the module.
llvm::Value* call_elementary(llvm::IRBuilder<>& builder, const std::string& name,
                             const std::vector<llvm::Value*>& arguments);

/// Calls the C library.
llvm::Value* call_library(llvm::IRBuilder<>& builder, const std::string& name,
                          const std::vector<llvm::Value*>& arguments);

/// Defines the vector functions that the vectoriser has called, and removes the others.
void define_vector_functions(llvm::Module& module);

}  // namespace dpde::codegen
