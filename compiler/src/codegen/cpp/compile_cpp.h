// SPDX-License-Identifier: Apache-2.0
// Compiles the emitted file with the system's C++ compiler ($CXX or c++, needed at run time) and loads the result.
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
  std::string error;     // message of the compiler or the loader
  std::string key = {};  // of the code in the cache; "" without a cache
};

/// `compiler`: a command; "" means $CXX, or c++ if that is not set. All temporary files are deleted before it returns.
CompileResult compile_cpp(const loop::Module& module, const std::string& compiler = "", CodeCache* cache = nullptr);

/// The same for given source text (for tools that compile an edited file).
CompileResult compile_cpp_source(const loop::Module& module, const std::string& source,
                                 const std::string& compiler = "", CodeCache* cache = nullptr);

struct LibraryResult {
  std::string bytes;  // content of the shared library
  std::string error;  // "" or the compiler's message
};
/// Compiles source text to a shared library that is kept. `march`: the processor, in the compiler's spelling.
LibraryResult compile_cpp_library(const std::string& source, const std::string& soname, const std::string& march);

/// The compiler flags of compile_cpp without the include folder, for assembly listings and build scripts. `march`: the
/// processor, in the compiler's spelling.
std::vector<std::string> cpp_flags(bool is_clang = false, const std::string& march = "native");

}  // namespace dpde::codegen
