// SPDX-License-Identifier: Apache-2.0
// An open text, with what is known of it now and what was known when it last made sense.
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

  /// A new text, of which only the tree is known until understand().
  void set_text(std::string text);
  /// False when it was interrupted, and nothing has changed.
  bool understand(Depth depth, const std::function<bool()>& is_interrupted = {});
  /// Whether nothing more is to be found at that depth.
  bool is_understood(Depth depth) const;

  const std::string& uri() const { return uri_; }
  const std::string& text() const { return text_; }
  /// The text alone.
  const SourceFile& source() const { return source_; }
  TextPlaces places() const { return TextPlaces(text_, in_bytes_); }

  /// As of the last understand(), with imports.
  const Understood& known() const { return known_; }
  /// Of the present text and of what it imported when it was last understood.
  const ast::File& file() const { return file_; }
  const std::vector<DeclaredName>& names() const { return names_; }
  /// With imports; what names() point into.
  const SourceFile& whole() const { return whole_; }
  /// Scenes and tasks by name, of the last text in which they made sense.
  const std::map<std::string, model::Problem>& problems() const { return problems_; }

  /// The declaration that a name at `offset` means, or nullptr.
  const DeclaredName* find(int offset) const;
  /// Those that may stand at `offset`, of blocks too.
  std::vector<const DeclaredName*> names_at(int offset) const;

  Json diagnostics() const;

 private:
  Json diagnostic(const Diagnostic& diagnostic, const TextPlaces& places) const;
  SourceRange own_range(SourceRange range) const;

  std::string uri_, text_;
  bool in_bytes_;
  std::optional<Depth> depth_;  // to which known_ goes
  SourceFile source_{"", ""}, whole_{"", ""};
  ast::File file_;
  std::vector<DeclaredName> names_;
  Understood known_;
  std::map<std::string, model::Problem> problems_;
};

}  // namespace dpde::lsp
