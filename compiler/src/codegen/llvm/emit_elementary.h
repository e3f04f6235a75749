// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: sin, exp, pow, ... of cells as functions of the module. A row calls the function of one
// number, which says what the function of 2, 4, 8 or 16 of them is called; the vectoriser then calls that. All of them
// are made from the text of dpde/elementary.h and give a cell the same bits.
#pragma once

#include <llvm/IR/IRBuilder.h>
#include <llvm/IR/Module.h>

#include <string>
#include <vector>

namespace dpde::codegen {

/// The value of the function `name` ("pow" too) for one cell, at the builder's place in a row. The function of one
/// number is defined in the module when it is first called.
llvm::Value* call_elementary(llvm::IRBuilder<>& builder, const std::string& name,
                             const std::vector<llvm::Value*>& arguments);

/// The C library's value.
llvm::Value* call_library(llvm::IRBuilder<>& builder, const std::string& name,
                          const std::vector<llvm::Value*>& arguments);

/// Defines the functions of vectors that the vectoriser has called, and removes the others.
void define_vector_functions(llvm::Module& module);

}  // namespace dpde::codegen
