// SPDX-License-Identifier: Apache-2.0
// Derivatives of repeats are repeats: their size, what they save, and what is refused.
#include <gtest/gtest.h>

#include <string>

#include "adjoint/adjoint.h"
#include "source/render.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"
#include "support/program_texts.h"
#include "syntax/parser.h"

namespace dpde {
namespace {

using testing::jacobi_kernels;
using testing::parse_module;

std::string sweeps(int count) {
  return jacobi_kernels + "program p { run begin; repeat " + std::to_string(count) +
         " { fill w periodic; run jacobi; swap w, v }; swap u, w }";
}

adjoint::Derivative adjoint_of(const std::string& text, const adjoint::Activity& wrt) {
  DiagnosticSink sink;
  adjoint::Derivative result = adjoint::adjoint(parse_module(text), "p", wrt, sink);
  EXPECT_FALSE(sink.has_errors());
  result.module = stencil::remove_dead_code(result.module);
  EXPECT_EQ(stencil::verify(result.module), std::vector<std::string>{});
  return result;
}

std::string without_counts(std::string text) {
  for (const std::string count : {"repeat 4000 ", "repeat 4 "}) {
    for (std::size_t at = text.find(count); at != std::string::npos; at = text.find(count))
      text.replace(at, count.size(), "repeat N ");
  }
  return text;
}

TEST(RepeatedAdjoint, HasTheSameSizeForAnyCount) {
  std::string wanted;
  for (const int count : {4, 4000}) {
    const stencil::Module module = parse_module(sweeps(count));
    DiagnosticSink sink;
    const auto tangent = adjoint::tangent(module, "p", {{"u"}, {"c"}}, sink);
    const auto adjoint = adjoint::adjoint(module, "p", {{"u"}, {"c"}}, sink);
    const auto of_tangent = adjoint::adjoint(tangent.module, tangent.program, {{"u_dot"}, {}}, sink);
    EXPECT_FALSE(sink.has_errors());
    std::string text;
    for (const stencil::Module* each : {&module, &tangent.module, &adjoint.module, &of_tangent.module})
      text += without_counts(print(*each));
    if (wanted.empty()) wanted = text;
    EXPECT_EQ(text, wanted);
  }
}

/// Behind the repeat fin_2 reads u_2, which nobody wrote.
TEST(RepeatedAdjoint, RefusesInTheWordsOfTheText) {
  const SourceFile source("p.dpde",
                          "kernel step(u: field, out v: field) { v = 0.5*u }\n"
                          "kernel square(u: field, out w: field) { w = u^2 }\n"
                          "kernel add(u: field, inout w: field) { w += u }\n"
                          "kernel fin(w: field, u: field, out n: field) {\n  n = w^2 + u\n}\n"
                          "program p { axes x periodic\n  repeat 2 { run step; swap u, v }\n"
                          "  run square; run fin; run add; swap u, n; keep w }\n");
  DiagnosticSink sink;
  const stencil::Module module = stencil::from_ast(ast::parse(source, sink), sink);
  ASSERT_FALSE(sink.has_errors());
  adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(
      render_text(source, sink.all()[0], false),
      "p.dpde:5:3: error[E0603]: the derivative of kernel fin needs field w as it was before it is changed again\n"
      "    n = w^2 + u\n    ^~~~~~~~~~~\nhelp: store the changed value in a field of its own\n");
}

TEST(RepeatedAdjoint, SavesWhatItReads) {
  const std::string text = print(adjoint_of(sweeps(5), {{"u"}, {"c"}}).module.programs[0]);
  EXPECT_NE(text.find("    save w in w_passes\n"), std::string::npos) << text;
  EXPECT_NE(text.find("    load w from w_passes\n"), std::string::npos) << text;
}

TEST(RepeatedAdjoint, SavesNothingWhereABlockIsLinear) {
  const std::string linear =
      "kernel smooth(u: field halo 1, b: field, out v: field, c: param) { v = c*(u[-1] + u[+1]) + b }\n"
      "program p { repeat 9 { fill u x = 0.3; run smooth; swap u, v } }";
  const std::string text = print(adjoint_of(linear, {{"u", "b"}, {}}).module.programs[0]);
  EXPECT_EQ(text.find("save"), std::string::npos) << text;
  EXPECT_EQ(text.find("run smooth\n"), std::string::npos) << text;
}

/// Two states of which the adjoint reads one.
TEST(RepeatedAdjoint, SavesOnlyTheStatesThatItReads) {
  const std::string two =
      "kernel k(u: field, w: field, out v: field, out q: field) { v = u/2 + w^2; q = w/3 + u }\n"
      "program p { axes x periodic; repeat 3 { run k; swap u, v; swap w, q } }";
  const std::string text = print(adjoint_of(two, {{"u", "w"}, {}}).module.programs[0]);
  EXPECT_NE(text.find("save w in"), std::string::npos) << text;
  EXPECT_EQ(text.find("save u in"), std::string::npos) << text;
}

TEST(RepeatedAdjoint, TheThirdOneIsRefused) {
  DiagnosticSink sink;
  const stencil::Module module = parse_module(sweeps(3));
  const auto first = adjoint::adjoint(module, "p", {{"u"}, {"c"}}, sink);
  const auto second = adjoint::adjoint(first.module, first.program, {{"u", "u_bar"}, {"c"}}, sink);
  ASSERT_FALSE(sink.has_errors()) << sink.all()[0].message;
  adjoint::adjoint(second.module, second.program, {{"u"}, {"c"}}, sink);
  ASSERT_TRUE(sink.has_errors());
  EXPECT_EQ(sink.all()[0].kind->code, "E0601");
  EXPECT_EQ(sink.all()[0].hint, "take its tangent, or the adjoint of the tangent");
}

}  // namespace
}  // namespace dpde
