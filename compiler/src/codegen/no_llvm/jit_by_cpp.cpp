// SPDX-License-Identifier: Apache-2.0
// Of builds without LLVM (-DDPDE_LLVM=OFF), in place of codegen/llvm: machine code by the system's C++ compiler, which
// takes seconds where LLVM takes a tenth of one. Options of the LLVM back end have no meaning here.
#include "codegen/cpp/compile_cpp.h"
#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm/jit.h"
#include "dpde/instruction_set.h"

namespace dpde::codegen {

bool has_llvm() { return false; }

JitResult jit(const loop::Module& module, const JitOptions&, CodeCache* cache) {
  CompileResult compiled = compile_cpp(module, "", cache);
  JitResult result;
  result.module = std::move(compiled.module);
  result.error = std::move(compiled.error);
  result.from_cache = compiled.from_cache;
  result.key = std::move(compiled.key);
  return result;
}

std::string host_description() { return "C++ " + std::string(word_of(instruction_set())); }

std::string emit_llvm(const loop::Module&, bool, const JitOptions&) { return ""; }
std::string emit_assembly(const loop::Module&, const JitOptions&) { return ""; }
std::vector<std::string> scalar_rows(const loop::Module&, const JitOptions&) { return {}; }

}  // namespace dpde::codegen
