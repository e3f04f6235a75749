// SPDX-License-Identifier: Apache-2.0
// The words of a file. Keywords are identifiers here: what they mean depends on where they stand.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "source/source_file.h"

namespace dpde::ast {

enum class TokenKind {
  end_of_file,
  line_break,  // one that may end an item; those behind an operator and the like are left out
  invalid,     // reported by the lexer already
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
  std::string_view spelling;  // a part of the source; of a text: without its quotes
  double value = 0;           // of a number
};

struct Comment {
  std::string text;  // from the # on, without blanks at the end
  SourceRange range;
};

/// As people call it: ")", "a name".
std::string_view name_of(TokenKind kind);

}  // namespace dpde::ast
