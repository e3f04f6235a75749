// SPDX-License-Identifier: Apache-2.0
// Where in a text a person is writing, told by its words alone, so that a half-written line, or a block that is not
// closed yet, says as much as a whole one.
#pragma once

#include <string>
#include <vector>

#include "source/source_file.h"
#include "syntax/parse/token.h"

namespace dpde::lsp {

struct CursorPlace {
  enum class Where { top, head, line, outside };  // outside: in a comment or a text

  Where where = Where::top;
  std::vector<std::string> blocks;  // the first words of those around it, the outermost one first: model, repeat
  std::vector<std::string> head;    // the names in the first line of the outermost one
  std::vector<ast::Token> before;   // of the line, or a block's first one, in front of what is being written

  /// Whether a line begins here.
  bool begins_line() const { return before.empty(); }
  /// The first word of the line.
  std::string_view word() const { return before.empty() ? std::string_view() : before.front().spelling; }
  bool is_behind(ast::TokenKind kind) const { return !before.empty() && before.back().kind == kind; }
  bool is_behind(std::string_view word) const { return !before.empty() && before.back().spelling == word; }
};

/// Tokens point into `source`.
CursorPlace cursor_place(const SourceFile& source, int offset);

/// The name at the place or just before it, without what stands behind its dots; its kind is not identifier where there
/// is none.
ast::Token word_at(const SourceFile& source, int offset);

}  // namespace dpde::lsp
