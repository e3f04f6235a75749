// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: a short pipeline around the loop vectoriser. Rows are already simplified and have one loop
// each, so most of -O3 would only cost time. Two of its passes do harm: GVN's load-PRE makes neighbours along x a
// dependence between cells, which cannot be vectorised (speed.md 3), and loop unswitching doubles the code for each
// mask.
#pragma once

#include <llvm/IR/Instructions.h>
#include <llvm/IR/Module.h>
#include <llvm/Target/TargetMachine.h>

#include "codegen/llvm/jit_options.h"

namespace dpde::codegen {

inline constexpr int cache_line = 64;  // bytes

/// Requires that `module` has been bound to `target`.
void optimise(llvm::Module& module, llvm::TargetMachine& target, Effort effort = Effort::full);

/// Marks the loop `body`, which ends with `again`, as parallel for the vectoriser although its pointers may alias: no
/// iteration reads a value that another one writes.
void say_rounds_are_apart(llvm::BasicBlock& body, llvm::BranchInst& again);

/// See JitOptions::reciprocals.
void allow_reciprocals(llvm::Module& module);

/// Whether the function has floating-point vector arithmetic.
bool is_vectorised(const llvm::Function& function);

}  // namespace dpde::codegen
