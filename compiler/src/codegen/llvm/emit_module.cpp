// SPDX-License-Identifier: Apache-2.0
#include "codegen/llvm/emit_module.h"

#include <llvm/IR/Verifier.h>
#include <llvm/Support/raw_ostream.h>

#include "codegen/llvm/emit_expr.h"
#include "loop/expressions.h"
#include "support/assert.h"

namespace dpde::codegen {

std::string row_symbol(const std::string& row) { return "row_" + row; }

std::string uniforms_symbol() { return "dpde_compute_uniforms"; }

std::string counted_symbol() { return "dpde_compute_counted"; }

std::string line_name(const loop::Stream& stream) {
  std::string name = stream.field;
  for (int axis = 1; axis < loop::max_rank; ++axis) {
    const int offset = stream.offset.at(axis);
    if (offset == 0) continue;
    name += std::string("_") + "xyz"[axis] + (offset < 0 ? "m" : "p") + std::to_string(std::abs(offset));
  }
  return name;
}

namespace {

void emit_uniforms(const loop::Module& module, llvm::Module& out, bool only_counted) {
  llvm::IRBuilder<> builder(out.getContext());
  auto* type = llvm::FunctionType::get(builder.getVoidTy(), {builder.getPtrTy(), builder.getPtrTy()}, false);
  auto* function = llvm::Function::Create(type, llvm::Function::ExternalLinkage,
                                          only_counted ? counted_symbol() : uniforms_symbol(), out);
  function->setDoesNotThrow();
  function->getArg(0)->setName("params");
  function->getArg(1)->setName("uniforms");
  builder.SetInsertPoint(llvm::BasicBlock::Create(out.getContext(), "entry", function));
  llvm::FastMathFlags flags;
  flags.setAllowContract();
  builder.setFastMathFlags(flags);

  const auto slot = [&](int argument, std::size_t index) {
    return builder.CreateConstInBoundsGEP1_64(builder.getDoubleTy(), function->getArg(argument), index);
  };
  Leaves leaves;
  for (std::size_t i = 0; i < module.params.size(); ++i) {
    leaves.params.push_back(
        builder.CreateAlignedLoad(builder.getDoubleTy(), slot(0, i), llvm::Align(8), module.params[i]));
  }
  for (std::size_t i = 0; i < module.counters.size(); ++i) {
    leaves.counters.push_back(builder.CreateAlignedLoad(builder.getDoubleTy(), slot(0, module.params.size() + i),
                                                        llvm::Align(8), module.counters[i]));
  }
  const std::vector<bool> counted = loop::counted_uniforms(module);
  ExprEmitter emitter(builder, leaves, builder.getDoubleTy(), nullptr);
  for (std::size_t i = 0; i < module.uniforms.size(); ++i) {
    if (only_counted && !counted[i]) {  // computed already
      leaves.uniforms.push_back(builder.CreateAlignedLoad(builder.getDoubleTy(), slot(1, i), llvm::Align(8)));
      continue;
    }
    leaves.uniforms.push_back(emitter.number(module.uniforms[i].value));
    builder.CreateAlignedStore(leaves.uniforms.back(), slot(1, i), llvm::Align(8));
  }
  builder.CreateRetVoid();
}

}  // namespace

bool may_vary(const loop::Row& row) { return row.sums.empty() && row.scatters.empty(); }

std::unique_ptr<llvm::Module> emit_module(const loop::Module& module, llvm::LLVMContext& context,
                                          const std::vector<RowVariant>& variants) {
  auto out = std::make_unique<llvm::Module>("dpde", context);
  emit_uniforms(module, *out, false);
  if (!module.counters.empty()) emit_uniforms(module, *out, true);
  for (const loop::Row& row : module.rows) {
    emit_row(module, row, *out);
    for (const RowVariant& variant : variants) {
      if (may_vary(row)) emit_row(module, row, *out, variant);
    }
  }
  std::string problems;
  llvm::raw_string_ostream stream(problems);
  if (llvm::verifyModule(*out, &stream)) unreachable(stream.str().c_str());
  return out;
}

}  // namespace dpde::codegen
