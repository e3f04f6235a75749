// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/jit.h"

#include <llvm-c/Core.h>
#include <llvm/Bitcode/BitcodeWriter.h>
#include <llvm/ExecutionEngine/Orc/LLJIT.h>
#include <llvm/IR/LLVMContext.h>
#include <llvm/Support/MemoryBuffer.h>
#include <llvm/Support/SmallVectorMemoryBuffer.h>
#include <llvm/Support/raw_ostream.h>

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
  /// Seconds since the last call, or since construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Cache key, everything the object depends on: the module before the passes, bound to its processor, and the effort.
std::string key_of(const llvm::Module& ir, Effort effort) {
  std::string key = effort == Effort::quick ? "object, quick\n" : "object\n";
  llvm::raw_string_ostream stream(key);
  llvm::WriteBitcodeToFile(ir, stream);
  return key;
}

using Object = llvm::SmallVector<char, 0>;

Object compile(llvm::Module& ir, llvm::TargetMachine& target, Effort effort, JitResult& result, Stopwatch& watch) {
  optimise(ir, target, effort);
  result.optimise_s = watch.lap();
  return generate(ir, target, llvm::CodeGenFileType::ObjectFile, effort);
}

/// A linker for one complete object: LLJIT's set-up for whole programs (constructors, thread locals) is skipped.
llvm::Expected<std::unique_ptr<llvm::orc::LLJIT>> link(Object object, const llvm::TargetMachine& target) {
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

/// Links and looks up all rows; sets result.error on failure.
void load(const loop::Module& module, const std::vector<RowVariant>& variants, Object object,
          const llvm::TargetMachine& target, JitResult& result, Stopwatch& watch) {
  auto linker = link(std::move(object), target);
  if (!linker) {
    result.error = llvm::toString(linker.takeError());
    return;
  }
  const auto find = [&](const std::string& symbol) -> void* {
    auto address = (*linker)->lookup(symbol);
    if (address) return address->toPtr<void*>();
    result.error = llvm::toString(address.takeError());
    return nullptr;
  };
  const auto code_of = [&](const std::string& row) {
    RowCode code(reinterpret_cast<dpde_row_fn>(find(row_symbol(row))));
    for (const RowVariant& variant : variants) {
      if (!may_vary(*module.find_row(row))) continue;
      code.variants.push_back({reinterpret_cast<dpde_row_fn>(find(row_symbol(row) + variant.suffix)),
                               variant.streams ? 1 : 0, variant.ahead ? 1 : 0});
    }
    return code;
  };
  ProgramTables tables(module, code_of, reinterpret_cast<ComputeUniforms>(find(uniforms_symbol())),
                       module.counters.empty() ? nullptr : reinterpret_cast<ComputeUniforms>(find(counted_symbol())));
  result.link_s = watch.lap();
  if (result.error.empty()) result.module = std::make_shared<JitModule>(std::move(tables), std::move(*linker));
}

}  // namespace

JitResult jit(const loop::Module& module, const JitOptions& options, CodeCache* cache) {
  JitResult result;
  Stopwatch watch;
  const std::unique_ptr<llvm::TargetMachine> target = host_target(result.error);
  if (target == nullptr) return result;
  llvm::LLVMContext context;
  context.setDiscardValueNames(true);
  const std::vector<RowVariant> variants = variants_for_host(options);
  const std::unique_ptr<llvm::Module> ir = emit_module(module, context, variants);
  bind_to_target(*ir, *target, options);
  if (options.reciprocals) allow_reciprocals(*ir);
  result.key = cache == nullptr ? "" : key_of(*ir, options.effort);
  result.emit_s = watch.lap();
  if (const std::optional<std::string> kept = cache == nullptr ? std::nullopt : cache->find(result.key)) {
    load(module, variants, Object(kept->begin(), kept->end()), *target, result, watch);
    result.from_cache = result.module != nullptr;
    if (result.from_cache) return result;
    result.error.clear();
  }
  Object object = compile(*ir, *target, options.effort, result, watch);
  if (cache != nullptr) cache->store(result.key, {object.data(), object.size()});
  load(module, variants, std::move(object), *target, result, watch);
  return result;
}

bool has_llvm() { return true; }

std::string host_description() {
  unsigned major = 0, minor = 0, patch = 0;
  LLVMGetVersion(&major, &minor, &patch);  // of the loaded library, not of its headers
  std::string error;
  const std::unique_ptr<llvm::TargetMachine> target = host_target(error);
  const std::string processor = target == nullptr
                                    ? error
                                    : target->getTargetTriple().str() + ' ' + target->getTargetCPU().str() + ' ' +
                                          target->getTargetFeatureString().str();
  return std::to_string(major) + '.' + std::to_string(minor) + '.' + std::to_string(patch) + ' ' + processor;
}

}  // namespace dpde::codegen
