// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/jit.h"

#include <llvm/ExecutionEngine/Orc/LLJIT.h>
#include <llvm/IR/LLVMContext.h>
#include <llvm/Support/MemoryBuffer.h>
#include <llvm/Support/SmallVectorMemoryBuffer.h>

#include <chrono>

#include "codegen/llvm/emit_module.h"
#include "codegen/llvm/optimise.h"
#include "codegen/llvm/target.h"

namespace dpde::codegen {

namespace {

class JitModule : public CompiledModule {
 public:
  JitModule(ProgramTables tables, std::unique_ptr<llvm::orc::LLJIT> code)
      : CompiledModule(std::move(tables)), code_(std::move(code)) {}

 private:
  std::unique_ptr<llvm::orc::LLJIT> code_;
};

class Stopwatch {
 public:
  /// Seconds since the last call, or since the beginning.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

llvm::SmallVector<char, 0> object_code(const loop::Module& module, const JitOptions& options,
                                       llvm::TargetMachine& target, JitResult& result, Stopwatch& watch) {
  llvm::LLVMContext context;
  context.setDiscardValueNames(true);
  const std::unique_ptr<llvm::Module> ir = emit_module(module, context);
  bind_to_target(*ir, target, options);
  result.emit_s = watch.lap();
  optimise(*ir, target);
  result.optimise_s = watch.lap();
  return generate(*ir, target, llvm::CodeGenFileType::ObjectFile);
}

/// A linker for one object. The object is complete, so none of what LLJIT does for whole programs (constructors, thread
/// locals) is set up.
llvm::Expected<std::unique_ptr<llvm::orc::LLJIT>> link(llvm::SmallVector<char, 0> object,
                                                       const llvm::TargetMachine& target) {
  llvm::orc::JITTargetMachineBuilder machine(target.getTargetTriple());
  auto linker = llvm::orc::LLJITBuilder()
                    .setJITTargetMachineBuilder(machine)
                    .setDataLayout(target.createDataLayout())
                    .setPlatformSetUp(llvm::orc::setUpInactivePlatform)
                    .create();
  if (!linker) return linker.takeError();
  auto buffer = std::make_unique<llvm::SmallVectorMemoryBuffer>(std::move(object), "dpde",
                                                                /*RequiresNullTerminator=*/false);
  if (llvm::Error error = (*linker)->addObjectFile(std::move(buffer))) return error;
  return linker;
}

}  // namespace

JitResult jit(const loop::Module& module, const JitOptions& options) {
  JitResult result;
  Stopwatch watch;
  const std::unique_ptr<llvm::TargetMachine> target = host_target(result.error);
  if (target == nullptr) return result;
  auto linker = link(object_code(module, options, *target, result, watch), *target);
  if (!linker) {
    result.error = llvm::toString(linker.takeError());
    return result;
  }
  const auto find = [&](const std::string& symbol) -> void* {
    auto address = (*linker)->lookup(symbol);
    if (address) return address->toPtr<void*>();
    result.error = llvm::toString(address.takeError());
    return nullptr;
  };
  ProgramTables tables(
      module, [&](const std::string& row) { return reinterpret_cast<dpde_row_fn>(find(row_symbol(row))); },
      reinterpret_cast<ComputeUniforms>(find(uniforms_symbol())));
  result.link_s = watch.lap();
  if (result.error.empty()) result.module = std::make_shared<JitModule>(std::move(tables), std::move(*linker));
  return result;
}

}  // namespace dpde::codegen
