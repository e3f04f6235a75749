// SPDX-License-Identifier: Apache-2.0
// The parser's position in the token stream, error reporting, and comments. After the first error in an item every peek
// returns line_break, so that all parsing functions return without further errors; recover() then skips to the next
// item. Inside parentheses and brackets line breaks are ignored.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/ast.h"
#include "syntax/parse/lexer.h"
#include "syntax/parse/token.h"

namespace dpde::ast {

class Cursor {
 public:
  Cursor(const SourceFile& source, DiagnosticSink& sink);

  const Token& peek() const { return failed_ ? stop_ : tokens_[position_]; }
  /// The token after the next one.
  const Token& peek_second() const;
  bool at(TokenKind kind) const { return peek().kind == kind; }
  bool at_word(std::string_view word) const;
  /// At a line break, `;`, `}` or the end of the file.
  bool at_end_of_item() const;
  /// At the first words of a block, such as `scene wave`.
  bool at_declaration() const;
  int position() const { return position_; }

  Token take();
  bool accept(TokenKind kind);
  bool accept_word(std::string_view word);
  /// Takes the token, or fails with "expected ... but found ...".
  bool expect(TokenKind kind);
  bool expect_word(std::string_view word, std::string hint = {});
  Identifier expect_name(const char* what);
  /// Takes u, or a vector component u.x.
  Identifier expect_component(const char* what);
  /// The same, or an array element c[1], c[i], A[i, j]; the name as written.
  Identifier expect_element(const char* what);
  /// Takes [i, 2] after a name; returns it as written.
  std::string expect_indices();
  int expect_whole_number();
  void skip_separators();

  /// Between these two calls line breaks are ignored. `open`: the token that was just taken.
  void begin_group(const Token& open);
  void end_group(TokenKind close);

  /// Called around a nested block; returns false if more than `most` blocks would be nested.
  bool begin_block(int most) { return ++blocks_ <= most; }
  void end_block() { --blocks_; }

  /// Reports and continues.
  void error(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint = {});
  /// Reports and stops until recover().
  void fail(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint = {});
  /// "expected ... but found ..."; silent if the lexer has reported an error.
  void fail_expected(std::string what, std::string hint = {});
  /// Fails unless the item ends here.
  void expect_end_of_item();
  /// Advice for 2x and k lap(u), or "" if no factor follows.
  std::string product_hint() const;
  bool failed() const { return failed_; }
  /// Skips to the end of the item that begins at token `start`, including { } blocks; always advances.
  void recover(int start);
  /// Skips past the block of the declaration that begins at token `start`, or to the next declaration.
  void skip_declaration(int start);

  /// Range from the token at index `first` to the one taken last.
  SourceRange range_since(int first) const;
  /// Empty range right after the token taken last.
  SourceRange behind_last() const;

  /// Takes the comments before the next token.
  Trivia take_comments_above();
  /// Takes the comment after the last token in the same line.
  std::string take_comment_behind();
  /// Moves comments inside the item just parsed to those above it.
  void collect_inner_comments(Trivia& trivia);
  bool has_line_break_since(int first) const;

 private:
  bool stands_first_in_line(int offset) const;
  bool has_blank_line_above(int offset) const;
  void add_comments_up_to(int offset, Trivia& trivia);
  void pass_line_breaks();
  void step_over(int start);
  void skip_one();  // a token, or a whole block
  bool starts_item(int index) const;

  const SourceFile& source_;
  DiagnosticSink& sink_;
  std::vector<Token> tokens_;
  std::vector<Comment> comments_;
  std::size_t next_comment_ = 0;
  std::vector<SourceRange> groups_;  // open parentheses and brackets
  Token stop_{TokenKind::line_break, {}, {}, 0};
  int position_ = 0;
  int last_ = -1;   // index of the token taken last
  int blocks_ = 0;  // number of enclosing blocks
  bool failed_ = false;
};

/// 'name', shortened if it is long.
std::string quoted(std::string_view text);
/// Description of a token, for "but found ...".
std::string describe(const Token& token);

}  // namespace dpde::ast
