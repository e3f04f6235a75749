// SPDX-License-Identifier: Apache-2.0
// Ahead-of-time compilation: writes a scene or task as files that hosts build and run without the compiler.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "model/from_ast.h"
#include "source/diagnostic.h"

namespace dpde::driver {

struct LibraryOptions {
  model::Selection selection;
  std::filesystem::path folder;
  std::string name;              // of the class and the files; "": name of the task or scene
  std::string march = "native";  // the processor, in the C++ compiler's spelling
  bool second_order = false;     // also compile Hessian-vector products (tasks only)
};
struct LibraryFiles {
  std::string name;
  std::vector<std::string> paths;
};

/// Writes NAME.cpp, NAME.h, NAME.cmake and libNAME.so. Existing files are replaced only if dpde wrote them. Returns
/// nullopt if `sink` has errors afterwards.
std::optional<LibraryFiles> build_library(const SourceFile& source, const LibraryOptions& options,
                                          DiagnosticSink& sink);

}  // namespace dpde::driver
