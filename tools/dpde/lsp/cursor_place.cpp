// SPDX-License-Identifier: Apache-2.0
#include "lsp/cursor_place.h"

#include <algorithm>

#include "source/diagnostic.h"
#include "syntax/parse/lexer.h"
#include "syntax/words.h"

namespace dpde::lsp {

using ast::Token;
using ast::TokenKind;

namespace {

/// Follows the tokens like a parser, but accepts everything.
class Scanner {
 public:
  explicit Scanner(CursorPlace& place) : place_(place), declarations_(ast::words_of_declarations()) {}

  void take(const Token& token, TokenKind next) {
    if (begins_declaration(token, next)) {
      place_.blocks.clear();
      depth_ = 0;
    }
    switch (token.kind) {
      case TokenKind::left_paren:
      case TokenKind::left_bracket: ++depth_; break;
      case TokenKind::right_paren:
      case TokenKind::right_bracket: depth_ = std::max(0, depth_ - 1); break;
      case TokenKind::left_brace: return open();
      case TokenKind::right_brace: return close();
      case TokenKind::semicolon: return end_line();
      case TokenKind::line_break:
        if (depth_ == 0 && next != TokenKind::left_brace) end_line();
        return;
      case TokenKind::end_of_file:
      case TokenKind::invalid:
      case TokenKind::identifier:
      case TokenKind::number:
      case TokenKind::text:
      case TokenKind::comma:
      case TokenKind::colon:
      case TokenKind::dot:
      case TokenKind::dot_dot:
      case TokenKind::assign:
      case TokenKind::plus_assign:
      case TokenKind::arrow:
      case TokenKind::plus:
      case TokenKind::minus:
      case TokenKind::star:
      case TokenKind::slash:
      case TokenKind::caret:
      case TokenKind::less:
      case TokenKind::less_equal:
      case TokenKind::greater:
      case TokenKind::greater_equal:
      case TokenKind::equal:
      case TokenKind::not_equal:
      case TokenKind::bar: break;
    }
    place_.before.push_back(token);
  }

  /// The context before the next token.
  CursorPlace::Where where() const {
    if (!place_.blocks.empty()) return CursorPlace::Where::line;
    return place_.before.empty() ? CursorPlace::Where::top : CursorPlace::Where::head;
  }

 private:
  bool begins_declaration(const Token& token, TokenKind next) const {
    return place_.before.empty() && token.kind == TokenKind::identifier && next == TokenKind::identifier &&
           std::ranges::find(declarations_, token.spelling) != declarations_.end();
  }
  void open() {
    if (place_.blocks.empty()) {
      place_.head.clear();
      for (const Token& token : place_.before) {
        if (token.kind == TokenKind::identifier) place_.head.emplace_back(token.spelling);
      }
    }
    place_.blocks.emplace_back(place_.word());
    end_line();
  }
  void close() {
    if (!place_.blocks.empty()) place_.blocks.pop_back();
    end_line();
  }
  void end_line() {
    place_.before.clear();
    depth_ = 0;
  }

  CursorPlace& place_;
  std::vector<std::string> declarations_;
  int depth_ = 0;  // of parentheses and brackets
};

bool is_word(const Token& token) { return token.kind == TokenKind::identifier; }

}  // namespace

CursorPlace cursor_place(const SourceFile& source, int offset) {
  DiagnosticSink unheard;
  const ast::TokenStream stream = ast::lex(source, unheard);
  CursorPlace place;
  for (const ast::Comment& comment : stream.comments) {
    if (offset <= comment.range.begin || offset > comment.range.end) continue;
    place.where = CursorPlace::Where::outside;
    return place;
  }
  Scanner scanner(place);
  for (std::size_t i = 0; i < stream.tokens.size(); ++i) {
    const Token& token = stream.tokens[i];
    const bool is_open = is_word(token) || token.kind == TokenKind::number;  // the word may continue
    const bool is_text = token.kind == TokenKind::text || token.kind == TokenKind::invalid;
    if (is_text && token.range.begin < offset && offset < token.range.end) {
      place.where = CursorPlace::Where::outside;
      return place;
    }
    if (token.kind == TokenKind::end_of_file || token.range.begin >= offset) break;
    if (is_open && token.range.end >= offset) break;
    const bool is_last = i + 1 >= stream.tokens.size();
    scanner.take(token, is_last ? TokenKind::end_of_file : stream.tokens[i + 1].kind);
  }
  place.where = scanner.where();
  if (place.where == CursorPlace::Where::head) {
    place.head.clear();
    for (const Token& token : place.before) {
      if (is_word(token)) place.head.emplace_back(token.spelling);
    }
  }
  return place;
}

Token word_at(const SourceFile& source, int offset) {
  DiagnosticSink unheard;
  const std::vector<Token> tokens = ast::lex(source, unheard).tokens;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (!is_word(tokens[i]) || offset < tokens[i].range.begin || offset > tokens[i].range.end) continue;
    while (i >= 2 && tokens[i - 1].kind == TokenKind::dot && is_word(tokens[i - 2])) i -= 2;  // u.x
    return tokens[i];
  }
  return {};
}

}  // namespace dpde::lsp
