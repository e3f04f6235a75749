// SPDX-License-Identifier: Apache-2.0
// Diagnostics as text and JSON, character by character.
#include "source/render.h"

#include <gtest/gtest.h>

#include "source/utf8.h"

namespace dpde {
namespace {

/// The report of one error over [begin, end) of `text`.
std::string rendered(const std::string& text, int begin, int end, std::string hint = {}) {
  const SourceFile file("w.dpde", text);
  DiagnosticSink sink;
  return render_text(file, sink.report("bad-number", {begin, end}, {"9"}, std::move(hint)));
}

const std::string header = "error[E0103]: number 9 is out of range\n";

TEST(RenderText, UnderlinesTheRange) {
  EXPECT_EQ(rendered("model m {\n  nu = abc\n}\n", 17, 20, "write 8"), "w.dpde:2:8: " + header +
                                                                           "    nu = abc\n"
                                                                           "         ^~~\n"
                                                                           "help: write 8\n");
}

TEST(RenderText, ShowsOneCaretForAPlaceBehindTheLine) {
  EXPECT_EQ(rendered("ab\ncd", 2, 2), "w.dpde:1:3: " + header + "  ab\n    ^\n");
  EXPECT_EQ(rendered("", 0, 0), "w.dpde:1:1: " + header + "  \n  ^\n");
  EXPECT_EQ(rendered("a", 99, 120), "w.dpde:1:2: " + header + "  a\n   ^\n");
}

TEST(RenderText, UnderlinesTheFirstLineOnly) {
  EXPECT_EQ(rendered("ab cd\nef", 3, 8), "w.dpde:1:4: " + header + "  ab cd\n     ^~\n");
}

TEST(RenderText, AlignsTabsAndWideCharacters) {
  // a tab goes to the next multiple of four columns; e with acute is one column, the ideograph two
  EXPECT_EQ(rendered("\ta\tb", 3, 4), "w.dpde:1:4: " + header + "      a   b\n          ^\n");
  EXPECT_EQ(rendered("\u00e9\u4e2d = x", 8, 9), "w.dpde:1:9: " + header + "  \u00e9\u4e2d = x\n        ^\n");
  EXPECT_EQ(rendered("\u4e2d x", 1, 2), "w.dpde:1:2: " + header + "  \u4e2d x\n  ^~\n");
}

TEST(RenderText, ShowsQuestionMarksForGarbage) {
  EXPECT_EQ(rendered(std::string("a\0\x1b[\xff\u202ex", 9), 8, 9), "w.dpde:1:9: " + header + "  a??[??x\n        ^\n");
}

TEST(RenderText, CutsLongLinesAroundTheCaret) {
  const std::string line = std::string(200, 'a') + "X" + std::string(200, 'b');
  EXPECT_EQ(rendered(line, 200, 201), "w.dpde:1:201: " + header + "  ..." + std::string(60, 'a') + "X" +
                                          std::string(99, 'b') + "...\n  " + std::string(63, ' ') + "^\n");
  EXPECT_EQ(rendered(line, 0, 401),
            "w.dpde:1:1: " + header + "  " + std::string(160, 'a') + "...\n  ^" + std::string(159, '~') + "\n");
  EXPECT_EQ(rendered(line, 401, 401),
            "w.dpde:1:402: " + header + "  ..." + std::string(60, 'b') + "\n  " + std::string(63, ' ') + "^\n");
}

TEST(RenderText, ShowsNoSourceWithoutARange) {
  const SourceFile file("w.dpde", "text");
  DiagnosticSink sink;
  EXPECT_EQ(render_text(file, sink.report("bad-number", {}, {"9"})), "w.dpde: " + header);
}

TEST(RenderText, ShowsNotesWithTheirPlaces) {
  const SourceFile file("w.dpde", "f(a\nb");
  DiagnosticSink sink;
  Diagnostic& diagnostic = sink.report("bad-number", {4, 5}, {"9"}, "close it");
  diagnostic.notes.push_back({{1, 2}, "this is still open"});
  diagnostic.notes.push_back({{}, "a remark"});
  EXPECT_EQ(render_text(file, diagnostic), "w.dpde:2:1: " + header +
                                               "  b\n"
                                               "  ^\n"
                                               "w.dpde:1:2: note: this is still open\n"
                                               "  f(a\n"
                                               "   ^\n"
                                               "note: a remark\n"
                                               "help: close it\n");
}

TEST(RenderText, ColoursOnDemand) {
  const SourceFile file("w.dpde", "x");
  DiagnosticSink sink;
  EXPECT_EQ(render_text(file, sink.report("bad-number", {0, 1}, {"9"}, "h"), true),
            "\033[1mw.dpde:1:1: \033[0m\033[1;31merror[E0103]:\033[0m \033[1mnumber 9 is out of range\033[0m\n"
            "  x\n"
            "  \033[1;32m^\033[0m\n"
            "\033[1;36mhelp:\033[0m h\n");
}

TEST(RenderJson, HasTheKeysOfTheCommand) {
  const SourceFile file("w.dpde", "a\nbc");
  DiagnosticSink sink;
  sink.report("bad-number", {3, 4}, {"\"9\""}, "h");
  sink.report("unterminated-text", {});
  EXPECT_EQ(diagnostics_json(file, sink.all()).dump(),
            R"([{"code":"E0103","severity":"error","message":"number \"9\" is out of range","file":"w.dpde","line":2,)"
            R"("column":2,"hint":"h"},{"code":"E0102","severity":"error","message":"text without a closing quote",)"
            R"("file":"w.dpde","line":0,"column":0,"hint":""}])");
  EXPECT_EQ(diagnostics_json(file, {}).dump(), "[]");
}

TEST(RenderJson, ReplacesBytesThatAreNoText) {
  const SourceFile file("w\xff.dpde", "a");
  DiagnosticSink sink;
  sink.report("bad-number", {0, 1}, {"\xc3"});
  EXPECT_EQ(diagnostics_json(file, sink.all()).dump(),
            "[{\"code\":\"E0103\",\"severity\":\"error\",\"message\":\"number \xEF\xBF\xBD is out of range\","
            "\"file\":\"w\xEF\xBF\xBD.dpde\",\"line\":1,\"column\":1,\"hint\":\"\"}]");
}

TEST(Utf8, AcceptsOnlyWellFormedSequences) {
  EXPECT_EQ(first_character("\u00e9").code, 0xE9u);
  EXPECT_EQ(first_character("\u20ac").bytes, 3);
  EXPECT_EQ(first_character("\U0001F600").code, 0x1F600u);
  for (const char* bad : {"\x80", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf0\x80\x80\x80", "\xf4\x90\x80\x80",
                          "\xf8\x88\x80\x80", "\xe2\x82", "\xff"}) {
    EXPECT_FALSE(first_character(bad).valid);
    EXPECT_EQ(first_character(bad).bytes, 1);
  }
  EXPECT_EQ(printable("a\tb\n\x7f\u202e\u00e9"), "a?b\n??\u00e9");
}

}  // namespace
}  // namespace dpde
