// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: the host processor. Its feature list is used, not its name, which hypervisors hide.
#pragma once

#include <llvm/IR/Module.h>
#include <llvm/Support/CodeGen.h>
#include <llvm/Target/TargetMachine.h>

#include <memory>
#include <string>
#include <vector>

#include "codegen/llvm/emit_module.h"
#include "codegen/llvm/jit_options.h"

namespace dpde::codegen {

/// Null, with the reason in `error`, if LLVM has no code generator for this processor.
std::unique_ptr<llvm::TargetMachine> host_target(std::string& error);

/// Row variants that may be faster on this processor.
std::vector<RowVariant> variants_for_host(const JitOptions& options);

/// Sets the data layout and triple of the module, and processor and vector width of its functions; the cost models need
/// them.
void bind_to_target(llvm::Module& module, const llvm::TargetMachine& target, const JitOptions& options);

/// Machine code or assembly of an optimised module.
llvm::SmallVector<char, 0> generate(llvm::Module& module, llvm::TargetMachine& target, llvm::CodeGenFileType type,
                                    Effort effort = Effort::full);

}  // namespace dpde::codegen
