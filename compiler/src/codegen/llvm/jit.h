// SPDX-License-Identifier: Apache-2.0
// Compiles a loop::Module in memory to rows that can be called, for the host processor. The code lives as long as the
// CompiledModule. Thread-safe.
#pragma once

#include <memory>
#include <string>

#include "codegen/code_cache.h"
#include "codegen/compiled_module.h"
#include "codegen/llvm/jit_options.h"
#include "loop/loop.h"

namespace dpde::codegen {

struct JitResult {
  std::shared_ptr<CompiledModule> module;  // null on failure; `error` says why
  std::string error;
  bool from_cache = false;
  std::string key;        // of the code in the cache; "" without a cache
  double emit_s = 0;      // building the IR
  double optimise_s = 0;  // passes over the IR
  double link_s = 0;      // machine code, and linking it into the process
};

/// False in a build without LLVM, where the system's C++ compiler does all this (codegen/no_llvm).
bool has_llvm();

JitResult jit(const loop::Module& module, const JitOptions& options = {}, CodeCache* cache = nullptr);

/// Names the processor that code is made for, and the LLVM version.
std::string host_description();

}  // namespace dpde::codegen
