// SPDX-License-Identifier: Apache-2.0
// One function for each kind of token. `0..1` is 0 `..` 1: a dot is part of a number only if no second dot follows.
#include "syntax/parse/lexer.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <system_error>

#include "source/utf8.h"
#include "support/assert.h"

namespace dpde::ast {
namespace {

constexpr std::size_t max_file_size = 4u << 20;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

struct Symbol {
  std::string_view spelling;
  TokenKind kind;
};

// Longer symbols first.
constexpr Symbol symbols[] = {
    {"..", TokenKind::dot_dot},
    {"+=", TokenKind::plus_assign},
    {"->", TokenKind::arrow},
    {"<=", TokenKind::less_equal},
    {">=", TokenKind::greater_equal},
    {"==", TokenKind::equal},
    {"!=", TokenKind::not_equal},
    {"(", TokenKind::left_paren},
    {")", TokenKind::right_paren},
    {"[", TokenKind::left_bracket},
    {"]", TokenKind::right_bracket},
    {"{", TokenKind::left_brace},
    {"}", TokenKind::right_brace},
    {",", TokenKind::comma},
    {";", TokenKind::semicolon},
    {":", TokenKind::colon},
    {".", TokenKind::dot},
    {"=", TokenKind::assign},
    {"+", TokenKind::plus},
    {"-", TokenKind::minus},
    {"*", TokenKind::star},
    {"/", TokenKind::slash},
    {"^", TokenKind::caret},
    {"<", TokenKind::less},
    {">", TokenKind::greater},
    {"|", TokenKind::bar},
};

const Symbol* find_symbol(std::string_view text) {
  for (const Symbol& symbol : symbols) {
    if (text.starts_with(symbol.spelling)) return &symbol;
  }
  return nullptr;
}

/// Replacement for a character that is often pasted from other programs.
struct Replacement {
  std::string_view character, hint;
};
constexpr Replacement replacements[] = {
    {"&", "write and"},
    {"!", "write not"},
    {"'", "write text in double quotes"},
    {"\u2212", "write the plain minus, -"},
    {"\u2013", "write the plain minus, -"},
    {"\u00d7", "write *"},
    {"\u00b7", "write *"},
    {"\u00b2", "write ^2"},
    {"\u00b3", "write ^3"},
    {"\u2264", "write <="},
    {"\u2265", "write >="},
    {"\u201c", "write plain double quotes, \""},
    {"\u201d", "write plain double quotes, \""},
};

class Lexer {
 public:
  Lexer(const SourceFile& source, DiagnosticSink& sink) : text_(source.text()), sink_(sink) {}

  TokenStream run() {
    if (text_.starts_with("\xEF\xBB\xBF")) position_ = 3;  // byte order mark
    while (position_ < text_.size()) read_one();
    add(TokenKind::end_of_file, 0);
    return std::move(stream_);
  }

 private:
  char at(std::size_t i) const { return i < text_.size() ? text_[i] : '\0'; }
  SourceRange range(std::size_t size) const {
    return {static_cast<int>(position_), static_cast<int>(position_ + size)};
  }

  void add(TokenKind kind, std::size_t size) {
    stream_.tokens.push_back({kind, range(size), text_.substr(position_, size)});
    position_ += size;
  }

  void read_one() {
    const char c = text_[position_];
    if (is_blank(c)) {
      ++position_;
    } else if (c == '\n') {
      read_line_break();
    } else if (c == '#') {
      read_comment();
    } else if (c == '"') {
      read_text();
    } else if (is_letter(c)) {
      read_identifier();
    } else if (is_digit(c) || (c == '.' && is_digit(at(position_ + 1)))) {
      read_number();
    } else if (const Symbol* symbol = find_symbol(text_.substr(position_))) {
      add(symbol->kind, symbol->spelling.size());
    } else {
      read_unknown();
    }
  }

  /// Several line breaks become one token.
  void read_line_break() {
    const bool is_first = stream_.tokens.empty() || stream_.tokens.back().kind != TokenKind::line_break;
    if (is_first) add(TokenKind::line_break, 0);
    ++position_;
  }

  /// Everything up to the end of the line.
  std::string_view rest_of_line() const { return text_.substr(position_, text_.substr(position_).find('\n')); }

  void read_comment() {
    std::string_view comment = rest_of_line();
    const std::size_t size = comment.size();
    while (is_blank(comment.back())) comment.remove_suffix(1);
    stream_.comments.push_back({std::string(comment), range(comment.size())});
    position_ += size;
  }

  void read_text() {
    const std::string_view rest = rest_of_line();
    const std::size_t quote = rest.find('"', 1);
    if (quote == std::string_view::npos) {
      sink_.report("unterminated-text", range(1), {}, "close it with \" on the same line");
      add(TokenKind::invalid, rest.size());
      return;
    }
    for (std::size_t i = 1; i < quote; ++i) {
      const auto byte = static_cast<unsigned char>(rest[i]);
      if (byte >= 0x20 && byte != 0x7F) continue;
      const int place = static_cast<int>(position_ + i);
      sink_.report("unexpected-character", {place, place + 1}, {describe(rest.substr(i))});
      add(TokenKind::invalid, quote + 1);
      return;
    }
    add(TokenKind::text, quote + 1);
    Token& token = stream_.tokens.back();
    token.spelling = token.spelling.substr(1, quote - 1);
  }

  void read_identifier() {
    std::size_t end = position_;
    while (is_letter(at(end)) || is_digit(at(end))) ++end;
    add(TokenKind::identifier, end - position_);
  }

  void read_number() {
    std::size_t end = position_;
    while (is_digit(at(end))) ++end;
    if (at(end) == '.' && at(end + 1) != '.') {
      ++end;
      while (is_digit(at(end))) ++end;
    }
    const std::size_t exponent = end + (at(end + 1) == '+' || at(end + 1) == '-' ? 2 : 1);
    if ((at(end) == 'e' || at(end) == 'E') && is_digit(at(exponent))) {
      end = exponent;
      while (is_digit(at(end))) ++end;
    }
    const std::string_view spelling = text_.substr(position_, end - position_);
    double value = 0;
    const auto result = std::from_chars(spelling.data(), spelling.data() + spelling.size(), value);
    const bool fits = result.ec == std::errc();
    if (!fits) sink_.report("bad-number", range(spelling.size()), {shortened(spelling)});
    add(fits ? TokenKind::number : TokenKind::invalid, spelling.size());
    stream_.tokens.back().value = value;
  }

  /// Reports a sequence of unknown characters once.
  void read_unknown() {
    const std::string_view rest = text_.substr(position_);
    std::size_t size = 0;
    while (size < rest.size() && is_unknown(rest[size])) ++size;
    const std::size_t first = first_character(rest).bytes;
    std::string hint;
    for (const Replacement& replacement : replacements) {
      if (rest.starts_with(replacement.character)) hint = replacement.hint;
    }
    sink_.report("unexpected-character", range(first), {describe(rest)}, std::move(hint));
    add(TokenKind::invalid, size);
  }

  static bool is_unknown(char c) {
    const bool known = is_blank(c) || c == '\n' || c == '#' || c == '"' || is_letter(c) || is_digit(c);
    return !known && find_symbol(std::string_view(&c, 1)) == nullptr;
  }

  static std::string describe(std::string_view text) {
    const Utf8Character character = first_character(text);
    if (character.valid && is_printable(character.code)) return fmt::format("'{}'", text.substr(0, character.bytes));
    return fmt::format("of code {}", character.valid ? static_cast<unsigned>(character.code)
                                                     : static_cast<unsigned>(static_cast<unsigned char>(text[0])));
  }

  static std::string shortened(std::string_view spelling) {
    return spelling.size() <= 24 ? std::string(spelling) : std::string(spelling.substr(0, 24)) + "...";
  }

  std::string_view text_;
  DiagnosticSink& sink_;
  std::size_t position_ = 0;
  TokenStream stream_;
};

bool is_binary_operator(const Token& token) {
  const bool symbol = token.kind >= TokenKind::plus && token.kind <= TokenKind::not_equal;
  return symbol || (token.kind == TokenKind::identifier && (token.spelling == "and" || token.spelling == "or"));
}

/// Whether an item cannot end after this token.
bool needs_more(const Token& token) {
  constexpr TokenKind kinds[] = {TokenKind::assign, TokenKind::plus_assign, TokenKind::arrow,     TokenKind::comma,
                                 TokenKind::colon,  TokenKind::dot_dot,     TokenKind::left_brace};
  return std::find(std::begin(kinds), std::end(kinds), token.kind) != std::end(kinds) || is_binary_operator(token);
}

/// Whether no item can begin with this token.
bool goes_on(const Token& token) {
  return token.kind == TokenKind::comma || token.kind == TokenKind::right_paren || is_binary_operator(token);
}

/// Removes line breaks that cannot end an item, and all but one of several.
std::vector<Token> significant(const std::vector<Token>& tokens) {
  std::vector<Token> kept;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const bool is_break = tokens[i].kind == TokenKind::line_break;
    if (!is_break && goes_on(tokens[i]) && !kept.empty() && kept.back().kind == TokenKind::line_break) kept.pop_back();
    if (is_break && (kept.empty() || kept.back().kind == TokenKind::line_break || needs_more(kept.back()))) continue;
    kept.push_back(tokens[i]);
  }
  return kept;
}

}  // namespace

TokenStream lex(const SourceFile& source, DiagnosticSink& sink) {
  const std::size_t size = source.text().size();
  if (size > max_file_size) {
    sink.report("file-too-large", {}, {fmt::format("{}", size)});
    return {{Token{TokenKind::end_of_file, {0, 0}, {}, 0}}, {}};
  }
  TokenStream stream = Lexer(source, sink).run();
  stream.tokens = significant(stream.tokens);
  return stream;
}

std::string_view name_of(TokenKind kind) {
  switch (kind) {
    case TokenKind::end_of_file: return "the end of the file";
    case TokenKind::line_break: return "the end of the line";
    case TokenKind::invalid: return "an unexpected character";
    case TokenKind::identifier: return "a name";
    case TokenKind::number: return "a number";
    case TokenKind::text: return "a text in quotes";
    case TokenKind::left_paren: return "'('";
    case TokenKind::right_paren: return "')'";
    case TokenKind::left_bracket: return "'['";
    case TokenKind::right_bracket: return "']'";
    case TokenKind::left_brace: return "'{'";
    case TokenKind::right_brace: return "'}'";
    case TokenKind::comma: return "','";
    case TokenKind::semicolon: return "';'";
    case TokenKind::colon: return "':'";
    case TokenKind::dot: return "'.'";
    case TokenKind::dot_dot: return "'..'";
    case TokenKind::assign: return "'='";
    case TokenKind::plus_assign: return "'+='";
    case TokenKind::arrow: return "'->'";
    case TokenKind::plus: return "'+'";
    case TokenKind::minus: return "'-'";
    case TokenKind::star: return "'*'";
    case TokenKind::slash: return "'/'";
    case TokenKind::caret: return "'^'";
    case TokenKind::less: return "'<'";
    case TokenKind::less_equal: return "'<='";
    case TokenKind::greater: return "'>'";
    case TokenKind::greater_equal: return "'>='";
    case TokenKind::equal: return "'=='";
    case TokenKind::not_equal: return "'!='";
    case TokenKind::bar: return "'|'";
  }
  unreachable("token kind");
}

}  // namespace dpde::ast
