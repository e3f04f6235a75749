// SPDX-License-Identifier: Apache-2.0
// No bytes crash, hang or overflow the stack, and every report points into the file.
#include <gtest/gtest.h>

#include <random>

#include "source/render.h"
#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

const std::string sample =
    "# sample\n"
    "model burgers { field u, v; param nu # c\n"
    "  let s = u + v\n"
    "  dt(u) = -advect(u, u) + nu*lap(u)\n"
    "}\n"
    "scene wave : burgers with cheap {\n"
    "  grid x = -1 .. 1, cells 128, periodic\n"
    "  boundary u: x.low = 0, x.high = 1\n"
    "  initial u = load(\"f.nc\", u) at t = 1/2; output u, v every 0.1\n"
    "  time 0 .. 1, step 1/32\n"
    "}\n"
    "task recover : wave { data r = u from scene fine at t = 0.5, 1; unknown initial u from 0\n"
    "  minimise mean((u - r)^2) over time; using adam(rate = 5), iterations 50 }\n"
    "kernel k(u: field halo 1, out v: field, sum n: param) {\n"
    "  let ux = if(inside[-1] grow 1, (u[+1] - u[-1])/2, load(\"f\"))\n"
    "  interp(v, ux) += -ux^2 < 3 and not u == 2\n"
    "}\n"
    "program p { fill u x periodic, y.low = 0; run k grow 1; swap u, v }\n"
    "loop t in 0 .. 32 { p }\n";

/// Reads, renders and, where there was no error, formats twice. Returns whether it was right.
bool try_out(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const File file = parse(source, sink);
  const int size = static_cast<int>(text.size());
  for (const Diagnostic& diagnostic : sink.all()) {
    EXPECT_TRUE(diagnostic.range.begin >= 0 && diagnostic.range.begin <= diagnostic.range.end);
    EXPECT_LE(diagnostic.range.end, size);
    EXPECT_FALSE(render_text(source, diagnostic).empty());
  }
  EXPECT_FALSE(diagnostics_json(source, sink.all()).dump().empty());
  const std::string printed = print(file);
  if (sink.has_errors()) return false;
  EXPECT_EQ(formatted(printed), printed);
  return true;
}

TEST(Robust, SampleIsRight) { EXPECT_TRUE(try_out(sample)); }

TEST(Robust, RandomMutations) {
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::string pieces[] = {
      "(",     ")",       "{",      "}",     "[",  "]", "\n",   ";",   "..",   "\"",
      "#",     "model m", "scene ", "= ",    ", ", "-", "not ", "1e5", "\xff", std::string(1, '\0'),
      "dt(u)", ":",       "\u03bd", "grow 1"};
  int wrong = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string text = sample;
    for (std::size_t edits = 1 + below(4); edits > 0 && !text.empty(); --edits) {
      const std::size_t at = below(text.size());
      const std::size_t kind = below(5);
      if (kind == 0) text.erase(at, 1 + below(20));
      if (kind == 1) text.insert(at, pieces[below(std::size(pieces))]);
      if (kind == 2) text[at] = static_cast<char>(below(256));
      if (kind == 3) text.insert(at, text.substr(below(text.size()), below(60)));
      if (kind == 4) text.resize(at + 1);
    }
    wrong += try_out(text) ? 0 : 1;
    if (HasFailure()) FAIL() << "round " << round << "\n" << text;
  }
  EXPECT_GT(wrong, 1000);  // most mutations break the sample
  EXPECT_LT(wrong, 2000);
}

TEST(Robust, RandomBytes) {
  std::mt19937 random(11);
  for (int round = 0; round < 500; ++round) {
    std::string text(random() % 200, ' ');
    for (char& c : text) c = static_cast<char>(random() % 256);
    try_out(text);
  }
}

TEST(Robust, EveryPrefix) {
  for (std::size_t size = 0; size < sample.size(); ++size) try_out(sample.substr(0, size));
}

TEST(Robust, DeepAndLong) {
  const auto repeat = [](const std::string& piece, int times) {
    std::string text;
    for (int i = 0; i < times; ++i) text += piece;
    return text;
  };
  EXPECT_FALSE(try_out("model m { dt(u) = " + repeat("(", 10000) + "u" + repeat(")", 10000) + " }"));
  EXPECT_FALSE(try_out("model m { dt(u) = " + repeat("-", 10000) + "u }"));
  EXPECT_FALSE(try_out("model m { dt(u) = a" + repeat("^a", 10000) + " }"));
  EXPECT_FALSE(try_out("model m { dt(u) = a" + repeat("+a", 100000) + " }"));
  EXPECT_FALSE(try_out("model m { dt(u) = " + repeat("f(", 10000) + " }"));
  EXPECT_FALSE(try_out("model m { dt(u) = " + repeat("not ", 10000) + " }"));
  EXPECT_FALSE(try_out(repeat("{", 100000)));
  EXPECT_FALSE(try_out(repeat("}", 100000)));
  EXPECT_FALSE(try_out(repeat("model m {", 10000)));
  EXPECT_TRUE(try_out("model m { field u" + repeat(", u", 100000) + " }"));
  EXPECT_TRUE(try_out("model m { let a = f(1" + repeat(", 1", 100000) + ") }"));
  EXPECT_TRUE(try_out(repeat("model m { }", 10000)));
  EXPECT_TRUE(try_out(repeat("# c\n", 100000)));
}

TEST(Robust, FilesOfMoreThanFourMebibytesAreRefused) {
  const SourceFile source("t.dpde", std::string((4u << 20) + 1, '#'));
  DiagnosticSink sink;
  EXPECT_TRUE(parse(source, sink).declarations.empty());
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].kind->code, "E0104");
}

}  // namespace
}  // namespace dpde::ast
