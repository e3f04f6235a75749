// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: the processor this runs on. Its feature list is trusted, its name is not (hypervisors hide
// it).
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

/// Null, with the reason in `error`, where LLVM has no code generator for this processor.
std::unique_ptr<llvm::TargetMachine> host_target(std::string& error);

/// Other code for rows that may be faster on this processor.
std::vector<RowVariant> variants_for_host(const JitOptions& options);

/// Data layout and triple of the module, processor and vector width of its functions: the cost models read them.
void bind_to_target(llvm::Module& module, const llvm::TargetMachine& target, const JitOptions& options);

/// Machine code or assembly of an optimised module.
llvm::SmallVector<char, 0> generate(llvm::Module& module, llvm::TargetMachine& target, llvm::CodeGenFileType type,
                                    Effort effort = Effort::full);

}  // namespace dpde::codegen
