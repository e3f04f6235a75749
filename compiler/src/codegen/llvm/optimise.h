// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: a short pipeline around the loop vectoriser. The rows arrive simplified and with one loop
// each, so most of -O3 would only cost time; two of its passes do harm: GVN's load-PRE makes neighbours along x into a
// chain from cell to cell that cannot be vectorised (speed.md 3), and loop unswitching doubles the code for each mask.
#pragma once

#include <llvm/IR/Instructions.h>
#include <llvm/IR/Module.h>
#include <llvm/Target/TargetMachine.h>

#include "codegen/llvm/jit_options.h"

namespace dpde::codegen {

inline constexpr int cache_line = 64;  // bytes

/// `module` has been bound to `target`.
void optimise(llvm::Module& module, llvm::TargetMachine& target, Effort effort = Effort::full);

/// Tells the vectoriser of a loop, `body`, that ends with `again` and whose pointers may be of the same memory: no
/// round reads what another one writes.
void say_rounds_are_apart(llvm::BasicBlock& body, llvm::BranchInst& again);

/// See JitOptions::reciprocals.
void allow_reciprocals(llvm::Module& module);

/// Whether the function computes with vectors of numbers.
bool is_vectorised(const llvm::Function& function);

}  // namespace dpde::codegen
