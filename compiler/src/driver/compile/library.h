// SPDX-License-Identifier: Apache-2.0
// Ahead of time: a scene or task as files that hosts build with and run without the compiler.
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
  std::string name;              // of the class and the files; "": that of the task or scene
  std::string march = "native";  // the processor, as the C++ compiler calls it
  bool second_order = false;     // of a task: products of second derivatives
};
struct LibraryFiles {
  std::string name;
  std::vector<std::string> paths;
};

/// Writes NAME.cpp, NAME.h, NAME.cmake and libNAME.so. Files that are there are replaced when dpde made them. nullopt
/// when `sink` has errors afterwards.
std::optional<LibraryFiles> build_library(const SourceFile& source, const LibraryOptions& options,
                                          DiagnosticSink& sink);

}  // namespace dpde::driver
