// SPDX-License-Identifier: Apache-2.0
// An open text, with the results of its last analysis and of the last one without errors.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lsp/declared_names.h"
#include "lsp/text_places.h"
#include "lsp/understood.h"

namespace dpde::lsp {

/// "order: 2 in space, 1 in time" of a scene.
using OrderText = std::function<std::string(const model::Problem&)>;

class Document {
 public:
  Document(std::string uri, bool in_bytes) : uri_(std::move(uri)), in_bytes_(in_bytes) {}

  /// Sets a new text, of which only the syntax tree is known until understand().
  void set_text(std::string text);
  /// Returns false and changes nothing if it was interrupted.
  bool understand(Depth depth, const std::function<bool()>& is_interrupted = {});
  /// Whether the analysis to that depth is complete.
  bool is_understood(Depth depth) const;

  const std::string& uri() const { return uri_; }
  const std::string& text() const { return text_; }
  /// The text without imports.
  const SourceFile& source() const { return source_; }
  TextPlaces places() const { return TextPlaces(text_, in_bytes_); }

  /// Results of the last understand(), with imports.
  const Understood& known() const { return known_; }
  /// For the present text, with the imports of the last analysis.
  const ast::File& file() const { return file_; }
  const std::vector<DeclaredName>& names() const { return names_; }
  /// With imports; names() refers to it.
  const SourceFile& whole() const { return whole_; }
  /// Scenes and tasks by name, from the last text in which they were valid.
  const std::map<std::string, model::Problem>& problems() const { return problems_; }

  /// The declaration of the name at `offset`, or nullptr.
  const DeclaredName* find(int offset) const;
  /// The names allowed at `offset`, those of blocks included.
  std::vector<const DeclaredName*> names_at(int offset) const;

  Json diagnostics() const;

 private:
  Json diagnostic(const Diagnostic& diagnostic, const TextPlaces& places) const;
  SourceRange own_range(SourceRange range) const;

  std::string uri_, text_;
  bool in_bytes_;
  std::optional<Depth> depth_;  // depth of known_
  SourceFile source_{"", ""}, whole_{"", ""};
  ast::File file_;
  std::vector<DeclaredName> names_;
  Understood known_;
  std::map<std::string, model::Problem> problems_;
};

}  // namespace dpde::lsp
