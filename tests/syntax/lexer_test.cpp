// SPDX-License-Identifier: Apache-2.0
// Tokens by their spelling.
#include "syntax/parse/lexer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace dpde::ast {
namespace {

/// Spellings with / for a line break; <code> for what the lexer complains about.
std::string words(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  std::string result;
  for (const Token& token : lex(source, sink).tokens) {
    if (token.kind == TokenKind::end_of_file) continue;
    if (!result.empty()) result += ' ';
    const bool is_break = token.kind == TokenKind::line_break;
    result += is_break ? "/" : std::string(token.spelling);
  }
  for (const Diagnostic& diagnostic : sink.all()) {
    result += fmt::format(" <{} {} at {}>", diagnostic.kind->code, diagnostic.message, diagnostic.range.begin);
  }
  return result;
}

double number(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const TokenStream stream = lex(source, sink);
  EXPECT_EQ(stream.tokens.size(), 2u) << text;
  EXPECT_EQ(stream.tokens[0].kind, TokenKind::number) << text;
  return stream.tokens[0].value;
}

TEST(Lexer, ReadsNumbers) {
  EXPECT_EQ(number("1"), 1.0);
  EXPECT_EQ(number("1.5"), 1.5);
  EXPECT_EQ(number(".5"), 0.5);
  EXPECT_EQ(number("2."), 2.0);
  EXPECT_EQ(number("1e-3"), 0.001);
  EXPECT_EQ(number("1.5E+3"), 1500.0);
  EXPECT_EQ(number("0.1"), 0.1);
}

TEST(Lexer, KeepsRangesApartFromNumbers) {
  EXPECT_EQ(words("0..1"), "0 .. 1");
  EXPECT_EQ(words("-1 .. 1"), "- 1 .. 1");
  EXPECT_EQ(words("0.5..1.5"), "0.5 .. 1.5");
  EXPECT_EQ(words("0...5"), "0 .. .5");
  EXPECT_EQ(words("1e..2"), "1 e .. 2");
  EXPECT_EQ(words("2x 1e 1e+"), "2 x 1 e 1 e +");
  EXPECT_EQ(words("x.low"), "x . low");
}

TEST(Lexer, RefusesNumbersOutOfRange) {
  EXPECT_EQ(words("1e999"), "1e999 <E0103 number 1e999 is out of range at 0>");
  EXPECT_EQ(words("1e-999"), "1e-999 <E0103 number 1e-999 is out of range at 0>");
}

TEST(Lexer, ReadsOperators) {
  EXPECT_EQ(words("a<=b>=c==d!=e+=f<g>h=i^j"), "a <= b >= c == d != e += f < g > h = i ^ j");
}

TEST(Lexer, EndsItemsAtLineBreaksThatCount) {
  EXPECT_EQ(words("a\nb"), "a / b");
  EXPECT_EQ(words("\n\na\n\n\nb\n"), "a / b /");
  EXPECT_EQ(words("a +\nb =\nc,\nd:\ne {\nf\n}"), "a + b = c , d : e { f / }");
  EXPECT_EQ(words("a\n+ b\n, c\n) and\nd\nor e"), "a + b , c ) and d or e");
  EXPECT_EQ(words("a # note\n+ b # note"), "a + b");
  EXPECT_EQ(words("a\r\nb"), "a / b");
  EXPECT_EQ(words("0 ..\n1"), "0 .. 1");
}

TEST(Lexer, KeepsComments) {
  const SourceFile source("t.dpde", "# one  \r\na # two\n#");
  DiagnosticSink sink;
  const TokenStream stream = lex(source, sink);
  ASSERT_EQ(stream.comments.size(), 3u);
  EXPECT_EQ(stream.comments[0].text, "# one");
  EXPECT_EQ(stream.comments[1].text, "# two");
  EXPECT_EQ(stream.comments[2].text, "#");
}

TEST(Lexer, ReadsTextWithoutItsQuotes) {
  const SourceFile source("t.dpde", "\"a # b\"");
  DiagnosticSink sink;
  const TokenStream stream = lex(source, sink);
  ASSERT_EQ(stream.tokens.size(), 2u);
  EXPECT_EQ(stream.tokens[0].kind, TokenKind::text);
  EXPECT_EQ(stream.tokens[0].spelling, "a # b");
  EXPECT_EQ(stream.tokens[0].range, (SourceRange{0, 7}));
}

TEST(Lexer, ReportsCharactersThatMeanNothing) {
  EXPECT_EQ(words("a \"bc\nd"), "a \"bc / d <E0102 text without a closing quote at 2>");
  EXPECT_EQ(words("a $$? b"), "a $$? b <E0101 unexpected character '$' at 2>");
  EXPECT_EQ(words("\u03bd"), "\u03bd <E0101 unexpected character '\u03bd' at 0>");
  EXPECT_EQ(words(std::string("a\0", 2)), std::string("a \0 <E0101 unexpected character of code 0 at 1>", 47));
  EXPECT_EQ(words("\"a\x01\""), "\"a\x01\" <E0101 unexpected character of code 1 at 2>");
  EXPECT_EQ(words("\xEF\xBB\xBF"
                  "a"),
            "a");
}

TEST(Lexer, RefusesFilesOverFourMebibytes) {
  const SourceFile large("t.dpde", std::string((4 << 20) + 1, '\n'));
  DiagnosticSink sink;
  EXPECT_EQ(lex(large, sink).tokens.size(), 1u);
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].message, "the file has 4194305 bytes, more than the 4194304 that are read");
  const SourceFile fits("t.dpde", std::string(4 << 20, '\n'));
  DiagnosticSink quiet;
  lex(fits, quiet);
  EXPECT_TRUE(quiet.all().empty());
}

}  // namespace
}  // namespace dpde::ast
