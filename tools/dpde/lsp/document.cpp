// SPDX-License-Identifier: Apache-2.0
#include "lsp/document.h"

#include <fmt/format.h>

#include <algorithm>

#include "files/imports.h"
#include "lsp/cursor_place.h"
#include "syntax/parser.h"

namespace dpde::lsp {

void Document::set_text(std::string text) {
  text_ = std::move(text);
  source_ = SourceFile(path_of_uri(uri_), text_);
  depth_.reset();
  DiagnosticSink unheard;
  whole_ = files::with_imports(source_, unheard);
  file_ = ast::parse(whole_, unheard);
  names_ = declared_names(whole_, file_);
}

bool Document::is_understood(Depth depth) const { return depth_ && (*depth_ >= depth || known_.has_errors()); }

bool Document::understand(Depth depth, const std::function<bool()>& is_interrupted) {
  Understood understood = lsp::understand(path_of_uri(uri_), text_, depth, is_interrupted);
  if (!understood.is_whole) return false;
  known_ = std::move(understood);
  depth_ = depth;
  for (auto& [name, problem] : known_.problems) problems_.insert_or_assign(name, problem);
  return true;
}

std::vector<const DeclaredName*> Document::names_at(int offset) const {
  const CursorPlace place = cursor_place(source_, offset);
  const std::set<int> known = blocks_known_to(file_, place.head);
  const bool is_scheme = !place.blocks.empty() && place.blocks.front() == "scheme";
  std::vector<const DeclaredName*> result;
  for (const DeclaredName& name : names_) {
    const bool is_field = name.word == "field" || name.word == "vector";
    if (name.block < 0 || known.contains(name.block) || (is_scheme && is_field)) result.push_back(&name);
  }
  return result;
}

/// Of several declarations with the name: that at the cursor itself, then one in its block, then visible ones.
const DeclaredName* Document::find(int offset) const {
  const ast::Token word = word_at(source_, offset);
  if (word.kind != ast::TokenKind::identifier) return nullptr;
  const DeclaredName* best = nullptr;
  int best_rank = 0;
  for (const DeclaredName* name : names_at(offset)) {
    if (name->name != word.spelling) continue;
    const bool is_here = name->range.begin == word.range.begin;
    const SourceRange block =
        name->block < 0 ? SourceRange{} : file_.declarations[static_cast<std::size_t>(name->block)].range;
    const bool is_own = name->block >= 0 && block.begin <= offset && offset <= block.end;
    const bool is_axis = name->word == "axis";  // a scene's x never refers to an axis in a model
    const int rank = is_here ? 4 : is_own ? 3 : name->block >= 0 && !is_axis ? 2 : 1;
    if (rank <= best_rank) continue;
    best = name;
    best_rank = rank;
  }
  return best;
}

/// A mistake in an imported file is shown at the import.
SourceRange Document::own_range(SourceRange range) const {
  if (!range.is_known()) return {0, 0};
  if (!known_.source.is_imported(range.begin)) return range;
  for (const ast::Declaration& declaration : known_.file.declarations) {
    const auto* import = std::get_if<ast::Import>(&declaration.kind);
    if (import != nullptr && !declaration.imported) return import->range;
  }
  return {0, 0};
}

Json Document::diagnostic(const Diagnostic& diagnostic, const TextPlaces& places) const {
  std::string message = diagnostic.message;
  const bool is_elsewhere = diagnostic.range.is_known() && known_.source.is_imported(diagnostic.range.begin);
  if (is_elsewhere) {
    const LineColumn place = known_.source.locate(diagnostic.range.begin);
    message =
        fmt::format("{}:{}:{}: {}", known_.source.path_of(diagnostic.range.begin), place.line, place.column, message);
  }
  if (!diagnostic.hint.empty()) message += "\nhelp: " + diagnostic.hint;
  Json row = {{"range", places.range(own_range(diagnostic.range))},
              {"severity", diagnostic.kind->severity == Severity::error ? 1 : 2},
              {"code", diagnostic.kind->code},
              {"source", "dpde"},
              {"message", message}};
  for (const Note& note : diagnostic.notes) {
    const SourceRange range = note.range.is_known() ? note.range : diagnostic.range;
    const Json location = {{"uri", uri_}, {"range", places.range(own_range(range))}};
    row["relatedInformation"].push_back(Json{{"location", location}, {"message", note.text}});
  }
  return row;
}

Json Document::diagnostics() const {
  const TextPlaces places = this->places();
  Json rows = Json::array();
  for (const Diagnostic& one : known_.diagnostics) rows.push_back(diagnostic(one, places));
  return rows;
}

}  // namespace dpde::lsp
