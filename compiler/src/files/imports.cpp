// SPDX-License-Identifier: Apache-2.0
#include "files/imports.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "files/files.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::files {
namespace fs = std::filesystem;

namespace {

/// Canonical path, equal for all spellings; also for files that do not exist.
fs::path identity(const fs::path& path) {
  std::error_code ignored;
  const fs::path known = fs::weakly_canonical(path, ignored);
  return known.empty() ? path.lexically_normal() : known;
}

std::vector<ast::Import> imports_of(const std::string& path, const std::string& text) {
  DiagnosticSink unheard;  // discarded: the whole text is parsed again with all messages
  std::vector<ast::Import> imports;
  for (const ast::Declaration& declaration : ast::parse(SourceFile(path, text), unheard).declarations) {
    if (const auto* found = std::get_if<ast::Import>(&declaration.kind)) imports.push_back(*found);
  }
  return imports;
}

class Importer {
 public:
  Importer(SourceFile source, DiagnosticSink& sink) : all_(std::move(source)), sink_(sink) {}

  SourceFile run() {
    const std::string path = all_.path(), text(all_.text());  // copies: append() moves the originals
    visit(path, text, 0);
    return std::move(all_);
  }

 private:
  /// Appends the imports of the file at `path`, whose text begins at offset `begin`.
  void visit(const std::string& path, const std::string& text, int begin) {
    seen_.push_back(identity(path));
    open_.emplace_back(identity(path), path);
    for (const ast::Import& import : imports_of(path, text)) {
      add(import.path, path, {begin + import.range.begin, begin + import.range.end});
    }
    open_.pop_back();
  }

  void add(const std::string& name, const std::string& from, SourceRange where) {
    const fs::path path = fs::path(from).parent_path() / name;
    const fs::path known = identity(path);
    const auto is_it = [&](const auto& open) { return open.first == known; };
    const auto opened = std::find_if(open_.begin(), open_.end(), is_it);
    if (opened != open_.end()) {
      report_cycle({opened, open_.end()}, path.string(), where);
      return;
    }
    if (std::find(seen_.begin(), seen_.end(), known) != seen_.end()) return;
    const std::optional<std::string> text = read_file(path, where, sink_);
    if (!text) return;
    const int begin = static_cast<int>(all_.text().size()) + 1;
    all_.append(path.string(), *text);
    visit(path.string(), *text, begin);
  }

  void report_cycle(const std::vector<std::pair<fs::path, std::string>>& ring, const std::string& last,
                    SourceRange where) {
    std::string way;
    for (const auto& [known, path] : ring) way += path + " -> ";
    sink_.report("cyclic-import", where, {last, way + last}, "put what both need into a third file and import that");
  }

  SourceFile all_;
  DiagnosticSink& sink_;
  std::vector<fs::path> seen_;
  std::vector<std::pair<fs::path, std::string>> open_;  // import chain from the first file to the present one
};

}  // namespace

SourceFile with_imports(SourceFile source, DiagnosticSink& sink) {
  if (source.text().find("import") == std::string_view::npos) return source;
  return Importer(std::move(source), sink).run();
}

std::string text_without_imports(const SourceFile& source) {
  if (source.count() == 1) return std::string(source.text());
  DiagnosticSink unheard;
  ast::File file = ast::parse(source, unheard);
  std::erase_if(file.declarations,
                [](const ast::Declaration& d) { return std::holds_alternative<ast::Import>(d.kind); });
  return print(file);
}

}  // namespace dpde::files
