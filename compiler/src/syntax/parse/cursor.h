// SPDX-License-Identifier: Apache-2.0
// The parser's place in the tokens, its errors and its comments. After the first error of an item every peek gives
// line_break, so that all parsing functions come to an end by themselves and say no more; recover() then goes to the
// next item. Inside of parentheses and brackets line breaks are passed over.
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
  /// The token behind the next one.
  const Token& peek_second() const;
  bool at(TokenKind kind) const { return peek().kind == kind; }
  bool at_word(std::string_view word) const;
  /// At a line break, `;`, `}` or the end of the file.
  bool at_end_of_item() const;
  /// At the first words of a block, as in `scene wave`.
  bool at_declaration() const;
  int position() const { return position_; }

  Token take();
  bool accept(TokenKind kind);
  bool accept_word(std::string_view word);
  /// Takes the token, or fails with "expected ... but found ...".
  bool expect(TokenKind kind);
  bool expect_word(std::string_view word, std::string hint = {});
  Identifier expect_name(const char* what);
  /// u, or the component u.x of a vector.
  Identifier expect_component(const char* what);
  /// The same, or an element of an array of them, c[1], c[i], A[i, j]: of the name as it is written.
  Identifier expect_element(const char* what);
  /// [i, 2] behind a name as a text, as it is written.
  std::string expect_indices();
  int expect_whole_number();
  void skip_separators();

  /// Between these two calls line breaks mean nothing. `open` is the token that was just taken.
  void begin_group(const Token& open);
  void end_group(TokenKind close);

  /// Around a block inside of an item; false where more than `most` would be inside one another.
  bool begin_block(int most) { return ++blocks_ <= most; }
  void end_block() { --blocks_; }

  /// Reports and goes on.
  void error(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint = {});
  /// Reports and stops until recover().
  void fail(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint = {});
  /// "expected ... but found ..."; quiet where the lexer has spoken already.
  void fail_expected(std::string what, std::string hint = {});
  /// Fails unless the item ends here.
  void expect_end_of_item();
  /// What to write for 2x and k lap(u), or "" where no factor follows.
  std::string product_hint() const;
  bool failed() const { return failed_; }
  /// To the end of the item that begins at token `start`, over whole { } blocks; always makes progress.
  void recover(int start);
  /// To behind the block of the declaration that begins at token `start`, or to where the next one begins.
  void skip_declaration(int start);

  /// Range from the token at index `first` to the one taken last.
  SourceRange range_since(int first) const;
  /// Just behind the token taken last.
  SourceRange behind_last() const;

  /// The comments up to the next token, taken out of the stream.
  Trivia take_comments_above();
  /// The comment in the same line behind the token taken last.
  std::string take_comment_behind();
  /// Comments inside of the item that was just parsed go above it.
  void collect_inner_comments(Trivia& trivia);
  bool has_line_break_since(int first) const;

 private:
  bool stands_first_in_line(int offset) const;
  bool has_blank_line_above(int offset) const;
  void add_comments_up_to(int offset, Trivia& trivia);
  void pass_line_breaks();
  void step_over(int start);
  void skip_one();  // token, or block with all that is in it
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
  int blocks_ = 0;  // inside of which the cursor is
  bool failed_ = false;
};

/// 'name', shortened when it is long.
std::string quoted(std::string_view text);
/// What stands there, for "but found ...".
std::string describe(const Token& token);

}  // namespace dpde::ast
