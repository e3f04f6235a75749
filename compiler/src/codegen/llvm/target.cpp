// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/target.h"

#include <llvm/Analysis/TargetTransformInfo.h>
#include <llvm/CodeGen/MachineModuleInfo.h>
#include <llvm/CodeGen/Passes.h>
#include <llvm/CodeGen/TargetPassConfig.h>
#include <llvm/IR/LegacyPassManager.h>
#include <llvm/MC/TargetRegistry.h>
#include <llvm/Support/TargetSelect.h>
#include <llvm/Support/raw_ostream.h>
#include <llvm/TargetParser/Host.h>

#include <algorithm>
#include <optional>
#include <set>

#include "codegen/x86_names.h"
#include "support/assert.h"

namespace dpde::codegen {

namespace {

struct Host {
  std::string triple, cpu, features, error;
  bool has_512_bits = false;
  const llvm::Target* target = nullptr;
};

/// Without this feature LLVM loads from displaced positions one by one for AVX2, and computes the positions one by one
/// too: a semi-Lagrangian sweep takes twice as long (tests/bench, "Kernels for AVX2").
constexpr const char* gathers = "+fast-gather";

bool is_x86(const std::string& triple) { return llvm::Triple(triple).getArch() == llvm::Triple::x86_64; }

Host find_host() {
  llvm::InitializeNativeTarget();
  llvm::InitializeNativeTargetAsmPrinter();
  Host host;
  host.triple = llvm::sys::getProcessTriple();
  host.target = llvm::TargetRegistry::lookupTarget(host.triple, host.error);
  if (const std::optional<InstructionSet> asked = asked_instruction_set(); asked && is_x86(host.triple)) {
    host.cpu = x86_name(*asked);
    host.has_512_bits = *asked == InstructionSet::v4;
    if (*asked == InstructionSet::v3) host.features = gathers;
    return host;
  }
  host.cpu = llvm::sys::getHostCPUName().str();
  std::set<std::string> features;  // sorted: the same text on every run
  for (const auto& feature : llvm::sys::getHostCPUFeatures()) {
    features.insert((feature.second ? "+" : "-") + feature.first().str());
  }
  host.has_512_bits = features.contains("+avx512f");
  if (features.contains("+avx2")) features.insert(gathers);
  for (const std::string& feature : features) host.features += (host.features.empty() ? "" : ",") + feature;
  return host;
}

/// Looked up once; thread-safe, as a local static.
const Host& host() {
  static const Host found = find_host();
  return found;
}

/// Longer functions are not scheduled again after register allocation. That takes quadratic time and gains nothing at
/// this length: 225 terms compile in 1.8 s, not 5.0 s. Unit: instructions.
constexpr unsigned most_scheduled_twice = 2000;

llvm::CodeGenOptLevel level_for(const llvm::Module& module) {
  const bool is_long = std::any_of(module.begin(), module.end(), [](const llvm::Function& f) {
    return f.getInstructionCount() > most_scheduled_twice;
  });
  return is_long ? llvm::CodeGenOptLevel::Less : llvm::CodeGenOptLevel::Default;
}

/// As TargetMachine::addPassesToEmitFile, without optimisation. Only the instruction selection is the usual one: it
/// decides which products are fused, and thus the last bit of results.
bool add_quick_passes(llvm::legacy::PassManager& passes, llvm::LLVMTargetMachine& target, llvm::raw_pwrite_stream& to,
                      llvm::CodeGenFileType type) {
  target.setOptLevel(llvm::CodeGenOptLevel::None);
  llvm::TargetPassConfig* const config = target.createPassConfig(passes);
  config->setDisableVerify(true);
  passes.add(config);
  auto* const info = new llvm::MachineModuleInfoWrapperPass(&target);  // owned by `passes`
  passes.add(info);
  passes.add(llvm::createTargetTransformInfoWrapperPass(target.getTargetIRAnalysis()));
  passes.add(llvm::createPreISelIntrinsicLoweringPass());
  config->addIRPasses();
  config->addPassesToHandleExceptions();
  config->addISelPrepare();
  target.setOptLevel(llvm::CodeGenOptLevel::Less);
  if (config->addInstSelector()) return true;
  target.setOptLevel(llvm::CodeGenOptLevel::None);
  passes.add(llvm::Pass::createPass(&llvm::FinalizeISelID));
  config->addMachinePasses();
  config->setInitialized();
  if (target.addAsmPrinter(passes, to, nullptr, type, info->getMMI().getContext())) return true;
  passes.add(llvm::createFreeMachineFunctionPass());
  return false;
}

}  // namespace

std::unique_ptr<llvm::TargetMachine> host_target(std::string& error) {
  if (host().target == nullptr) {
    error = host().error;
    return nullptr;
  }
  llvm::TargetOptions options;
  options.AllowFPOpFusion = llvm::FPOpFusion::Standard;  // fuse only instructions marked `contract`
  std::unique_ptr<llvm::TargetMachine> machine(
      host().target->createTargetMachine(host().triple, host().cpu, host().features, options, llvm::Reloc::PIC_,
                                         llvm::CodeModel::Small, llvm::CodeGenOptLevel::Default, /*JIT=*/true));
  if (machine == nullptr) error = "LLVM cannot generate code for " + host().triple;
  return machine;
}

std::vector<RowVariant> variants_for_host(const JitOptions& options) {
  if (!options.variants) return {};
  const bool has_lines =
      options.vector_width == 0 && host().has_512_bits;  // vectors fill a cache line: only then rows prefetch
  std::vector<RowVariant> variants{{".streams", 0, true, has_lines}};
  if (!has_lines) return variants;
  variants.push_back({".ahead", 0, false, true});
  variants.push_back({".narrow", 256});
  return variants;
}

void bind_to_target(llvm::Module& module, const llvm::TargetMachine& target, const JitOptions& options) {
  module.setDataLayout(target.createDataLayout());
  module.setTargetTriple(target.getTargetTriple().str());
  const int width = options.vector_width != 0 ? options.vector_width : host().has_512_bits ? 512 : 256;
  for (llvm::Function& function : module) {
    if (function.isDeclaration()) continue;
    function.addFnAttr("target-cpu", target.getTargetCPU());
    function.addFnAttr("target-features", target.getTargetFeatureString());
    if (!function.hasFnAttribute("prefer-vector-width"))
      function.addFnAttr("prefer-vector-width", std::to_string(width));
  }
}

llvm::SmallVector<char, 0> generate(llvm::Module& module, llvm::TargetMachine& target, llvm::CodeGenFileType type,
                                    Effort effort) {
  llvm::SmallVector<char, 0> bytes;
  llvm::raw_svector_ostream stream(bytes);
  llvm::legacy::PassManager passes;
  target.setOptLevel(level_for(module));
  const bool fails = effort == Effort::quick
                         ? add_quick_passes(passes, static_cast<llvm::LLVMTargetMachine&>(target), stream, type)
                         : target.addPassesToEmitFile(passes, stream, nullptr, type, /*DisableVerify=*/true);
  require(!fails, "the target writes object files");
  passes.run(module);
  return bytes;
}

}  // namespace dpde::codegen
