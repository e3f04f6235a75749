// SPDX-License-Identifier: Apache-2.0
// Runs the system's C++ compiler on the emitted file and loads the result. Needs a compiler at run time ($CXX or c++).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "codegen/code_cache.h"
#include "codegen/compiled_module.h"
#include "loop/loop.h"

namespace dpde::codegen {

struct CompileResult {
  std::shared_ptr<CompiledModule> module;  // null on failure
  bool from_cache = false;
  std::string error;     // what the compiler or the loader said
  std::string key = {};  // of the code in the cache; "" without one
};

/// `compiler` "": $CXX, else c++. All temporary files are gone when this returns.
CompileResult compile_cpp(const loop::Module& module, const std::string& compiler = "", CodeCache* cache = nullptr);

/// The same for given source text (for tools that compile a file somebody edited).
CompileResult compile_cpp_source(const loop::Module& module, const std::string& source,
                                 const std::string& compiler = "", CodeCache* cache = nullptr);

struct LibraryResult {
  std::string bytes;  // of the shared library
  std::string error;  // "" or what the compiler said
};
/// Source text as a shared library that stays. `march`: the processor, as the compiler calls it.
LibraryResult compile_cpp_library(const std::string& source, const std::string& soname, const std::string& march);

/// The flags compile_cpp gives the compiler beside the folder of kernel_abi.h, for assembly listings and build scripts.
/// `march`: the processor, as the compiler calls it.
std::vector<std::string> cpp_flags(bool is_clang = false, const std::string& march = "native");

}  // namespace dpde::codegen
