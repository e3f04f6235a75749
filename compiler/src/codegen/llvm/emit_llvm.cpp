// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/emit_llvm.h"

#include <llvm/IR/LLVMContext.h>
#include <llvm/Support/raw_ostream.h>

#include "codegen/llvm/emit_module.h"
#include "codegen/llvm/optimise.h"
#include "codegen/llvm/target.h"
#include "support/assert.h"

namespace dpde::codegen {

namespace {

/// A module with its own context, optimised for the host processor.
struct Optimised {
  Optimised(const loop::Module& module, const JitOptions& options) {
    std::string error;
    target = host_target(error);
    require(target != nullptr, error.c_str());
    ir = emit_module(module, context, variants_for_host(options));
    bind_to_target(*ir, *target, options);
    optimise(*ir, *target);
  }
  llvm::LLVMContext context;
  std::unique_ptr<llvm::TargetMachine> target;
  std::unique_ptr<llvm::Module> ir;
};

std::string text_of(const llvm::Module& module) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  module.print(stream, nullptr);
  return text;
}

}  // namespace

std::string emit_llvm(const loop::Module& module, bool optimised, const JitOptions& options) {
  if (optimised) return text_of(*Optimised(module, options).ir);
  llvm::LLVMContext context;
  return text_of(*emit_module(module, context));
}

std::string emit_assembly(const loop::Module& module, const JitOptions& options) {
  Optimised optimised(module, options);
  const auto text = generate(*optimised.ir, *optimised.target, llvm::CodeGenFileType::AssemblyFile);
  return std::string(text.begin(), text.end());
}

std::vector<std::string> scalar_rows(const loop::Module& module, const JitOptions& options) {
  const Optimised optimised(module, options);
  std::vector<std::string> result;
  for (const loop::Row& row : module.rows) {
    if (!is_vectorised(*optimised.ir->getFunction(row_symbol(row.name)))) result.push_back(row.name);
  }
  return result;
}

}  // namespace dpde::codegen
