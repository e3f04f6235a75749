// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/library.h"

#include <fmt/format.h>

#include <fstream>

#include "codegen/cpp/compile_cpp.h"
#include "codegen/cpp/emit_library.h"
#include "driver/compile/declared.h"
#include "driver/compile/links.h"
#include "driver/scene/scene_table.h"
#include "files/files.h"

namespace dpde::driver {

namespace {

namespace fs = std::filesystem;

/// Whether `path` does not exist or was written by dpde.
bool may_write(const fs::path& path, DiagnosticSink& sink) {
  std::error_code error;
  if (!fs::exists(path, error)) return true;
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  if (line.find(codegen::generated_mark()) != std::string::npos) return true;
  sink.report("cannot-write", {}, {path.string(), "it is there already, and not by dpde"},
              "choose another --name or folder");
  return false;
}

}  // namespace

std::optional<LibraryFiles> build_library(const SourceFile& source, const LibraryOptions& options,
                                          DiagnosticSink& sink) {
  std::optional<Compiled> compiled =
      compile_for_hosts(source, options.selection, std::nullopt, {.second_order = options.second_order}, sink);
  if (!compiled) return std::nullopt;
  compiled->code = std::make_shared<codegen::CompiledModule>(codegen::ProgramTables(compiled->loop, {}, nullptr));
  for (const LinkedProgram& derivative : linked_programs(*compiled))
    compiled->code->set_links(derivative.program, derivative.links);
  const auto kept = std::make_shared<const Compiled>(std::move(*compiled));
  const std::shared_ptr<const SceneTable> table = SceneTable::make(kept, source, {}, sink);
  if (!table) return std::nullopt;
  const dpde_scene& scene = table->scene();
  const std::string name = !options.name.empty() ? options.name : scene.task != nullptr ? scene.task : scene.name;
  const std::string clash = codegen::library_name_clash(scene, name);
  if (!clash.empty()) {
    sink.report("bad-option", place_of(source, scene.name, scene.task != nullptr ? scene.task : ""), {clash},
                "--name gives the class another name; names of parameters and fields are those of the model");
    return std::nullopt;
  }
  const std::vector<std::pair<fs::path, std::string>> texts{
      {options.folder / (name + ".cpp"), codegen::emit_library_source(kept->loop, scene, name, source)},
      {options.folder / (name + ".h"), codegen::emit_library_header(scene, name, source)},
      {options.folder / (name + ".cmake"), codegen::emit_library_cmake(name)}};
  const fs::path library = options.folder / ("lib" + name + ".so");
  const codegen::LibraryResult built =
      codegen::compile_cpp_library(texts.front().second, library.filename().string(), options.march);
  if (!built.error.empty()) {
    sink.report("machine-failed", {}, {built.error});
    return std::nullopt;  // before any file is written
  }
  if (!files::make_folder(options.folder, sink)) return std::nullopt;
  for (const auto& [path, text] : texts) {
    if (!may_write(path, sink)) return std::nullopt;
  }
  LibraryFiles files{name, {}};
  for (const auto& [path, text] : texts) {
    if (!files::write_file(path, text, sink)) return std::nullopt;
    files.paths.push_back(path.string());
  }
  if (!files::write_file(library, built.bytes, sink)) return std::nullopt;
  files.paths.push_back(library.string());
  return files;
}

}  // namespace dpde::driver
