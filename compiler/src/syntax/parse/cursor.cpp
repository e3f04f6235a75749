// SPDX-License-Identifier: Apache-2.0
// Functions that advance stop at the last token, end_of_file. recover() and skip_declaration() advance by at least one
// token, so every loop of the parser ends.
#include "syntax/parse/cursor.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

namespace dpde::ast {
namespace {

constexpr std::string_view declaration_words[] = {"model", "scene",    "scheme",   "task",    "kernel",  "program",
                                                  "loop",  "function", "operator", "network", "dataset", "chart"};

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool may_precede_declaration(TokenKind kind) {
  return kind == TokenKind::line_break || kind == TokenKind::semicolon || kind == TokenKind::left_brace ||
         kind == TokenKind::right_brace;
}

bool is_reserved(std::string_view word) { return is_one_of(word, {"and", "or", "not"}); }

}  // namespace

std::string quoted(std::string_view text) {
  constexpr std::size_t longest = 40;
  return fmt::format("'{}{}'", text.substr(0, longest), text.size() > longest ? "..." : "");
}

std::string describe(const Token& token) {
  if (token.kind == TokenKind::identifier || token.kind == TokenKind::number) return quoted(token.spelling);
  return std::string(name_of(token.kind));
}

Cursor::Cursor(const SourceFile& source, DiagnosticSink& sink) : source_(source), sink_(sink) {
  TokenStream stream = lex(source, sink);
  tokens_ = std::move(stream.tokens);
  comments_ = std::move(stream.comments);
}

// ---- reading -------------------------------------------------------------------------------------------------------
const Token& Cursor::peek_second() const {
  if (failed_) return stop_;
  std::size_t i = std::min(position_ + std::size_t{1}, tokens_.size() - 1);
  while (!groups_.empty() && tokens_[i].kind == TokenKind::line_break) ++i;
  return tokens_[i];
}

bool Cursor::at_word(std::string_view word) const { return at(TokenKind::identifier) && peek().spelling == word; }

bool Cursor::at_end_of_item() const {
  const TokenKind kind = peek().kind;
  return kind == TokenKind::line_break || kind == TokenKind::semicolon || kind == TokenKind::right_brace ||
         kind == TokenKind::end_of_file;
}

bool Cursor::at_declaration() const {
  if (!at(TokenKind::identifier) || peek_second().kind != TokenKind::identifier) return false;
  const bool is_first = position_ == 0 || may_precede_declaration(tokens_[position_ - 1].kind);
  if (!is_first) return false;
  const auto* end = std::end(declaration_words);
  return std::find(std::begin(declaration_words), end, peek().spelling) != end;
}

Token Cursor::take() {
  if (failed_) return stop_;
  const Token token = tokens_[position_];
  last_ = position_;
  if (token.kind != TokenKind::end_of_file) ++position_;
  pass_line_breaks();
  return token;
}

void Cursor::pass_line_breaks() {
  while (!groups_.empty() && tokens_[position_].kind == TokenKind::line_break) ++position_;
}

bool Cursor::accept(TokenKind kind) {
  if (!at(kind) || failed_) return false;
  take();
  return true;
}

bool Cursor::accept_word(std::string_view word) {
  if (!at_word(word)) return false;
  take();
  return true;
}

bool Cursor::expect(TokenKind kind) {
  if (accept(kind)) return true;
  fail_expected(std::string(name_of(kind)));
  return false;
}

bool Cursor::expect_word(std::string_view word, std::string hint) {
  if (accept_word(word)) return true;
  fail_expected(quoted(word), std::move(hint));
  return false;
}

Identifier Cursor::expect_name(const char* what) {
  if (!at(TokenKind::identifier) || is_reserved(peek().spelling)) {
    fail_expected(what);
    return {};
  }
  const Token token = take();
  return {std::string(token.spelling), token.range};
}

Identifier Cursor::expect_component(const char* what) {
  Identifier name = expect_name(what);
  if (!accept(TokenKind::dot)) return name;
  const Identifier part = expect_name("the name of a component, as in u.x");
  return {name.name + "." + part.name, {name.range.begin, part.range.end}};
}

Identifier Cursor::expect_element(const char* what) {
  Identifier name = expect_component(what);
  if (!at(TokenKind::left_bracket)) return name;
  const std::string indices = expect_indices();
  return {name.name + indices, {name.range.begin, behind_last().end}};
}

std::string Cursor::expect_indices() {
  const Token open = peek();
  expect(TokenKind::left_bracket);
  begin_group(open);
  std::string text;
  do {
    text += text.empty() ? "[" : ", ";
    const bool is_name = at(TokenKind::identifier);
    text += is_name ? expect_name("an index").name : std::to_string(expect_whole_number());
  } while (accept(TokenKind::comma));
  end_group(TokenKind::right_bracket);
  return text + "]";
}

int Cursor::expect_whole_number() {
  const int start = position_;
  const bool negative = accept(TokenKind::minus);
  if (!negative) accept(TokenKind::plus);
  if (!at(TokenKind::number)) {
    fail_expected("a whole number");
    return 0;
  }
  const Token token = take();
  int value = 0;
  const char* end = token.spelling.data() + token.spelling.size();
  const auto result = std::from_chars(token.spelling.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) {
    fail("not-whole", range_since(start), {quoted(token.spelling)});
    return 0;
  }
  return negative ? -value : value;
}

void Cursor::skip_separators() {
  while (!failed_ && (at(TokenKind::line_break) || at(TokenKind::semicolon))) ++position_;
}

void Cursor::begin_group(const Token& open) {
  if (failed_) return;
  groups_.push_back(open.range);
  pass_line_breaks();
}

void Cursor::end_group(TokenKind close) {
  if (failed_) return;
  if (!at(close)) {
    fail_expected(std::string(name_of(close)));
    return;
  }
  groups_.pop_back();  // before take(): line breaks after the token count again
  take();
}

// ---- errors --------------------------------------------------------------------------------------------------------
void Cursor::error(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint) {
  sink_.report(kind, range, arguments, std::move(hint));
}

void Cursor::fail(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments, std::string hint) {
  if (failed_) return;
  error(kind, range, arguments, std::move(hint));
  failed_ = true;
}

void Cursor::fail_expected(std::string what, std::string hint) {
  if (failed_) return;
  if (at(TokenKind::invalid)) {  // the lexer has reported it
    failed_ = true;
    return;
  }
  const bool is_below = position_ > 0 && tokens_[position_ - 1].kind == TokenKind::line_break;
  const bool is_over = at(TokenKind::line_break) || at(TokenKind::end_of_file) || (is_below && !groups_.empty());
  const bool points_behind = is_over && last_ >= 0;
  std::string found = describe(is_over && !at(TokenKind::end_of_file) ? stop_ : peek());
  Diagnostic& diagnostic = sink_.report("unexpected", points_behind ? behind_last() : peek().range,
                                        {std::move(what), std::move(found)}, std::move(hint));
  if (is_over && !groups_.empty()) diagnostic.notes.push_back({groups_.back(), "this is still open"});
  failed_ = true;
}

void Cursor::expect_end_of_item() {
  if (!at_end_of_item()) fail_expected("the end of the line", product_hint());
}

std::string Cursor::product_hint() const {
  const bool is_factor = at(TokenKind::identifier) || at(TokenKind::left_paren) || at(TokenKind::number);
  const bool is_call = at(TokenKind::identifier) && peek_second().kind == TokenKind::left_paren;
  if (!is_factor || last_ < 0 || (!is_call && peek().range.begin != behind_last().end)) return {};
  return "a product is written with *, as in 2*x";
}

bool Cursor::starts_item(int index) const {
  const TokenKind kind = tokens_[index].kind;
  if (kind != TokenKind::identifier) return kind == TokenKind::right_brace || kind == TokenKind::end_of_file;
  const TokenKind next = tokens_[index + 1].kind;
  return next == TokenKind::identifier || next == TokenKind::assign || next == TokenKind::plus_assign ||
         next == TokenKind::left_paren || next == TokenKind::dot;
}

void Cursor::recover(int start) {
  failed_ = false;
  const bool was_open = !groups_.empty();
  groups_.clear();
  step_over(start);
  if (was_open && tokens_[position_ - 1].kind == TokenKind::line_break && starts_item(position_)) --position_;
  while (!at(TokenKind::semicolon) && !at(TokenKind::right_brace) && !at(TokenKind::end_of_file) && !at_declaration()) {
    if (at(TokenKind::line_break) && (!was_open || starts_item(position_ + 1))) break;
    skip_one();
  }
}

void Cursor::skip_declaration(int start) {
  failed_ = false;
  groups_.clear();
  step_over(start);
  while (!at(TokenKind::left_brace) && !at(TokenKind::end_of_file) && !at_declaration()) ++position_;
  if (at(TokenKind::left_brace)) skip_one();
}

void Cursor::step_over(int start) {
  if (position_ == start && !at(TokenKind::left_brace) && !at(TokenKind::end_of_file)) ++position_;
}

void Cursor::skip_one() {
  int depth = 0;
  do {
    if (at(TokenKind::left_brace)) ++depth;
    if (at(TokenKind::right_brace)) --depth;
    if (!at(TokenKind::end_of_file)) ++position_;
  } while (depth > 0 && !at(TokenKind::end_of_file) && !at_declaration());
}

// ---- source ranges -------------------------------------------------------------------------------------------------
SourceRange Cursor::range_since(int first) const {
  const int begin = tokens_[first].range.begin;
  return {begin, last_ < first ? begin : tokens_[last_].range.end};
}

SourceRange Cursor::behind_last() const {
  const int end = last_ < 0 ? 0 : tokens_[last_].range.end;
  return {end, end};
}

// ---- comments ------------------------------------------------------------------------------------------------------
bool Cursor::stands_first_in_line(int offset) const {
  const std::string_view above = source_.text().substr(0, offset);
  const std::size_t last = above.find_last_not_of(" \t\r");
  return last == std::string_view::npos || above[last] == '\n';
}

bool Cursor::has_blank_line_above(int offset) const {
  if (!stands_first_in_line(offset)) return false;
  const std::size_t line_break = source_.text().substr(0, offset).find_last_of('\n');
  return line_break != std::string_view::npos && stands_first_in_line(static_cast<int>(line_break));
}

void Cursor::add_comments_up_to(int offset, Trivia& trivia) {
  for (; next_comment_ < comments_.size() && comments_[next_comment_].range.begin < offset; ++next_comment_) {
    const Comment& comment = comments_[next_comment_];
    const bool blank = has_blank_line_above(comment.range.begin);
    if (trivia.before.empty()) trivia.blank_before = blank;
    if (blank && !trivia.before.empty()) trivia.before.emplace_back();
    trivia.before.push_back(comment.text);
  }
}

Trivia Cursor::take_comments_above() {
  Trivia trivia;
  const int offset = tokens_[position_].range.begin;
  add_comments_up_to(offset, trivia);
  const bool blank = has_blank_line_above(offset);
  if (trivia.before.empty()) {
    trivia.blank_before = blank;
  } else if (blank) {
    trivia.before.emplace_back();
  }
  return trivia;
}

std::string Cursor::take_comment_behind() {
  if (next_comment_ >= comments_.size() || last_ < 0) return {};
  const Comment& comment = comments_[next_comment_];
  const int end = tokens_[last_].range.end;
  if (comment.range.begin < end) return {};
  const std::string_view between = source_.text().substr(end, comment.range.begin - end);
  if (between.find_first_not_of(" \t\r;") != std::string_view::npos) return {};
  return comments_[next_comment_++].text;
}

void Cursor::collect_inner_comments(Trivia& trivia) {
  const bool blank = trivia.blank_before;
  const bool was_empty = trivia.before.empty();
  if (last_ >= 0) add_comments_up_to(tokens_[last_].range.end, trivia);
  if (was_empty) trivia.blank_before = blank;
}

bool Cursor::has_line_break_since(int first) const {
  const SourceRange range = range_since(first);
  return source_.text().substr(range.begin, range.end - range.begin).find('\n') != std::string_view::npos;
}

}  // namespace dpde::ast
