// SPDX-License-Identifier: Apache-2.0
// Line tables, the sink, and suggestions.
#include "source/diagnostic.h"

#include <gtest/gtest.h>

#include "source/source_file.h"

namespace dpde {
namespace {

TEST(SourceFile, LocatesOffsetsByLineAndColumn) {
  const SourceFile file("a.dpde", "ab\n\ncd");
  EXPECT_EQ(file.line_count(), 3);
  const auto at = [&](int offset) { return std::pair(file.locate(offset).line, file.locate(offset).column); };
  EXPECT_EQ(at(0), std::pair(1, 1));
  EXPECT_EQ(at(2), std::pair(1, 3));  // the line break belongs to the line it ends
  EXPECT_EQ(at(3), std::pair(2, 1));
  EXPECT_EQ(at(5), std::pair(3, 2));
  EXPECT_EQ(at(6), std::pair(3, 3));
  EXPECT_EQ(at(100), std::pair(3, 3));
  EXPECT_EQ(at(-1), std::pair(1, 1));
}

TEST(SourceFile, GivesLinesWithoutTheirBreaks) {
  const SourceFile file("a.dpde", "ab\r\n\ncd\n");
  EXPECT_EQ(file.line_count(), 4);
  EXPECT_EQ(file.line(1), "ab");
  EXPECT_EQ(file.line(2), "");
  EXPECT_EQ(file.line(3), "cd");
  EXPECT_EQ(file.line(4), "");
  EXPECT_EQ(file.line(0), "");
  EXPECT_EQ(file.line(5), "");
  EXPECT_EQ(SourceFile("", "").line(1), "");
}

TEST(DiagnosticSink, FillsInArgumentsInOrder) {
  DiagnosticSink sink;
  EXPECT_FALSE(sink.has_errors());
  sink.report("unexpected", {3, 4}, {"{}", "b"}, "a hint").notes.push_back({{0, 1}, "a note"});
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_TRUE(sink.has_errors());
  EXPECT_EQ(sink.all()[0].message, "expected {} but found b");
  EXPECT_EQ(sink.all()[0].kind->code, "E0201");
  EXPECT_EQ(sink.all()[0].hint, "a hint");
  EXPECT_EQ(sink.all()[0].notes[0].text, "a note");
}

TEST(DiagnosticSink, KeepsTwentyErrorsAndStaysFailed) {
  DiagnosticSink sink;
  for (int i = 0; i < 50; ++i) sink.report("bad-number", {i, i + 1}, {"9"}).hint = std::to_string(i);
  EXPECT_TRUE(sink.has_errors());
  ASSERT_EQ(sink.all().size(), 20u);
  EXPECT_EQ(sink.all().back().hint, "19");
}

/// Of many unknown names each hint is a search among all that are known.
TEST(DiagnosticSink, MakesHintsOfWhatIsKept) {
  DiagnosticSink sink;
  int made = 0;
  const auto hint = [&] { return std::to_string(++made); };
  for (int i = 0; i < 50; ++i) sink.report("bad-number", {i % 30, i % 30 + 1}, {"9"}, hint);
  EXPECT_EQ(made, 20);
  EXPECT_TRUE(sink.is_full());
  EXPECT_EQ(sink.all().back().hint, "20");
}

TEST(NearestName, FindsSlipsOfTheFinger) {
  const std::vector<std::string> words = {"grid", "initial", "exact", "boundary", "time", "step", "observe"};
  EXPECT_EQ(nearest_name("grd", words), "grid");
  EXPECT_EQ(nearest_name("gird", words), "grid");  // neighbours swapped: one edit
  EXPECT_EQ(nearest_name("inital", words), "initial");
  EXPECT_EQ(nearest_name("Exact", words), "exact");
  EXPECT_EQ(nearest_name("bonudray", words), "boundary");
}

TEST(NearestName, IsSilentWhereNothingIsNear) {
  const std::vector<std::string> words = {"grid", "u", "nu"};
  EXPECT_EQ(nearest_name("v", words), "");
  EXPECT_EQ(nearest_name("vector", words), "");
  EXPECT_EQ(nearest_name("", words), "");
  EXPECT_EQ(nearest_name("grid", {}), "");
  EXPECT_EQ(nearest_name(std::string(1000000, 'g'), words), "");
}

}  // namespace
}  // namespace dpde
