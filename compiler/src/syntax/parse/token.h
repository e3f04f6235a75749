// SPDX-License-Identifier: Apache-2.0
// Tokens of a file. Keywords are identifiers here: their meaning depends on the position.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "source/source_file.h"

namespace dpde::ast {

enum class TokenKind {
  end_of_file,
  line_break,  // may end an item; line breaks after an operator etc. are removed
  invalid,     // already reported by the lexer
  identifier,
  number,
  text,
  left_paren,
  right_paren,
  left_bracket,
  right_bracket,
  left_brace,
  right_brace,
  comma,
  semicolon,
  colon,
  dot,
  dot_dot,
  assign,
  plus_assign,
  arrow,
  plus,
  minus,
  star,
  slash,
  caret,
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  bar,
};

struct Token {
  TokenKind kind = TokenKind::end_of_file;
  SourceRange range;
  std::string_view spelling;  // part of the source; for a text without its quotes
  double value = 0;           // for a number
};

struct Comment {
  std::string text;  // from # on, without trailing blanks
  SourceRange range;
};

/// Name for messages: ")", "a name".
std::string_view name_of(TokenKind kind);

}  // namespace dpde::ast
