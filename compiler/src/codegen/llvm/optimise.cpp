// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/optimise.h"

#include <llvm/Analysis/ValueTracking.h>
#include <llvm/IR/Constants.h>
#include <llvm/IR/InstIterator.h>
#include <llvm/IR/Instructions.h>
#include <llvm/IR/Metadata.h>
#include <llvm/IR/PassManager.h>
#include <llvm/Passes/PassBuilder.h>
#include <llvm/Transforms/IPO/AlwaysInliner.h>
#include <llvm/Transforms/InstCombine/InstCombine.h>
#include <llvm/Transforms/Scalar/EarlyCSE.h>
#include <llvm/Transforms/Scalar/LICM.h>
#include <llvm/Transforms/Scalar/LoopPassManager.h>
#include <llvm/Transforms/Scalar/SimplifyCFG.h>
#include <llvm/Transforms/Vectorize/LoopVectorize.h>

#include <algorithm>

#include "codegen/llvm/emit_elementary.h"
#include "codegen/llvm/emit_module.h"
#include "codegen/llvm/line_loads.h"

namespace dpde::codegen {

namespace {

bool is_number_vector(const llvm::Type* type) {
  return type->isVectorTy() && type->getScalarType()->isFloatingPointTy();
}

/// Makes stores bypass the caches, for row variants that ask for it. Only aligned vector stores have such a form; marks
/// set earlier would keep the vectoriser from working. Rows begin on cache lines, and vectors do not cross them.
class StreamStores : public llvm::PassInfoMixin<StreamStores> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager&) {
    if (!function.hasFnAttribute(streaming_attribute)) return llvm::PreservedAnalyses::all();
    const llvm::DataLayout& layout = function.getParent()->getDataLayout();
    llvm::Type* one = llvm::Type::getInt32Ty(function.getContext());
    llvm::MDNode* wish =
        llvm::MDNode::get(function.getContext(), llvm::ConstantAsMetadata::get(llvm::ConstantInt::get(one, 1)));
    for (llvm::Instruction& instruction : llvm::instructions(function)) {
      auto* store = llvm::dyn_cast<llvm::StoreInst>(&instruction);
      if (store == nullptr || !is_number_vector(store->getValueOperand()->getType())) continue;
      const auto* line = llvm::dyn_cast<llvm::Argument>(llvm::getUnderlyingObject(store->getPointerOperand()));
      if (line == nullptr || !line->hasAttribute(llvm::Attribute::WriteOnly)) continue;
      if (!line->hasNoAliasAttr()) continue;  // overwrites values that were read, so it is in the caches
      store->setAlignment(llvm::Align(std::min<uint64_t>(
          cache_line, layout.getTypeStoreSize(store->getValueOperand()->getType()).getFixedValue())));
      store->setMetadata(llvm::LLVMContext::MD_nontemporal, wish);
    }
    return llvm::PreservedAnalyses::all();
  }
  static bool isRequired() { return true; }
};

/// Vectorises rows with sums in quick code too, so that partial sums are the same for every effort.
class VectoriseSums : public llvm::PassInfoMixin<VectoriseSums> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses) {
    const bool has_sum = std::ranges::any_of(llvm::instructions(function), [](const llvm::Instruction& instruction) {
      return llvm::isa<llvm::PHINode>(instruction) && instruction.getType()->isFloatingPointTy();
    });
    return has_sum ? llvm::LoopVectorizePass().run(function, analyses) : llvm::PreservedAnalyses::all();
  }
};

llvm::ModulePassManager pipeline(Effort effort) {
  llvm::FunctionPassManager functions;
  functions.addPass(llvm::EarlyCSEPass());
  functions.addPass(llvm::InstCombinePass());
  functions.addPass(llvm::createFunctionToLoopPassAdaptor(llvm::LICMPass(llvm::LICMOptions()), /*UseMemorySSA=*/true));
  if (effort == Effort::full) {
    functions.addPass(llvm::LoopVectorizePass());
  } else {
    functions.addPass(VectoriseSums());
  }
  functions.addPass(llvm::InstCombinePass());
  functions.addPass(llvm::SimplifyCFGPass());
  functions.addPass(LineLoads());
  functions.addPass(StreamStores());
  llvm::ModulePassManager modules;
  modules.addPass(llvm::createModuleToFunctionPassAdaptor(std::move(functions)));
  modules.addPass(llvm::AlwaysInlinerPass(/*InsertLifetime=*/false));
  return modules;
}

}  // namespace

void optimise(llvm::Module& module, llvm::TargetMachine& target, Effort effort) {
  llvm::LoopAnalysisManager loops;
  llvm::FunctionAnalysisManager functions;
  llvm::CGSCCAnalysisManager components;
  llvm::ModuleAnalysisManager modules;
  llvm::PassBuilder builder(&target);  // without the target there is no cost model, and hardly any loop is vectorised
  builder.registerModuleAnalyses(modules);
  builder.registerCGSCCAnalyses(components);
  builder.registerFunctionAnalyses(functions);
  builder.registerLoopAnalyses(loops);
  builder.crossRegisterProxies(loops, functions, components, modules);
  pipeline(effort).run(module, modules);
  define_vector_functions(module);
}

void say_rounds_are_apart(llvm::BasicBlock& body, llvm::BranchInst& again) {
  llvm::LLVMContext& context = body.getContext();
  llvm::MDNode* group = llvm::MDNode::getDistinct(context, {});
  for (llvm::Instruction& instruction : body) {
    if (instruction.mayReadOrWriteMemory()) instruction.setMetadata(llvm::LLVMContext::MD_access_group, group);
  }
  llvm::MDNode* apart =
      llvm::MDNode::get(context, {llvm::MDString::get(context, "llvm.loop.parallel_accesses"), group});
  llvm::MDNode* loop = llvm::MDNode::getDistinct(context, {nullptr, apart});
  loop->replaceOperandWith(0, loop);
  again.setMetadata(llvm::LLVMContext::MD_loop, loop);
}

void allow_reciprocals(llvm::Module& module) {
  for (llvm::Function& function : module) {
    for (llvm::Instruction& instruction : llvm::instructions(function)) {
      if (instruction.getOpcode() == llvm::Instruction::FDiv) instruction.setHasAllowReciprocal(true);
    }
  }
}

bool is_vectorised(const llvm::Function& function) {
  for (const llvm::Instruction& instruction : llvm::instructions(function)) {
    if (const auto* store = llvm::dyn_cast<llvm::StoreInst>(&instruction)) {
      if (is_number_vector(store->getValueOperand()->getType())) return true;
    }
    if (instruction.isBinaryOp() && is_number_vector(instruction.getType())) return true;
  }
  return false;
}

}  // namespace dpde::codegen
