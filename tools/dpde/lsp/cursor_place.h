// SPDX-License-Identifier: Apache-2.0
// The context of the cursor, found only from the words of the text, so that it works for a half-written line and for a
// block that is not closed yet.
#pragma once

#include <string>
#include <vector>

#include "source/source_file.h"
#include "syntax/parse/token.h"

namespace dpde::lsp {

struct CursorPlace {
  enum class Where { top, head, line, outside };  // outside: in a comment or a text

  Where where = Where::top;
  std::vector<std::string> blocks;  // first words of the enclosing blocks, outermost first: model, repeat
  std::vector<std::string> head;    // the names in the first line of the outermost block
  std::vector<ast::Token> before;   // tokens of the line (or of a block's first line) before the one being written

  /// Whether the cursor is at the first word of a line.
  bool begins_line() const { return before.empty(); }
  /// The first word of the line.
  std::string_view word() const { return before.empty() ? std::string_view() : before.front().spelling; }
  bool is_behind(ast::TokenKind kind) const { return !before.empty() && before.back().kind == kind; }
  bool is_behind(std::string_view word) const { return !before.empty() && before.back().spelling == word; }
};

/// Tokens point into `source`.
CursorPlace cursor_place(const SourceFile& source, int offset);

/// The name at the position or just before it, without the part after its dots; its kind is not identifier if there is
/// none.
ast::Token word_at(const SourceFile& source, int offset);

}  // namespace dpde::lsp
