// SPDX-License-Identifier: Apache-2.0
// Which rows become one, what their sweeps bind, and that what is repeated costs no further row.
#include "loop/share_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "loop/expressions.h"
#include "loop/from_stencil.h"
#include "loop/loop_samples.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"
#include "model/from_ast.h"
#include "stencil/lower/from_model.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"

namespace dpde {
namespace {

stencil::Module read(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  const ast::File file = parse(source, sink);
  const stencil::Module module = stencil::from_ast(file, sink);
  for (const Diagnostic& diagnostic : sink.all()) ADD_FAILURE() << diagnostic.message;
  return module;
}

loop::Module lower(const std::string& text) {
  const stencil::Module module = read(text);
  std::vector<std::string> names;
  for (const stencil::Program& program : module.programs) names.push_back(program.name);
  const loop::Module result = loop::from_stencil(module, names);
  EXPECT_EQ(loop::verify(result), std::vector<std::string>{});
  return result;
}

std::string text_of(const std::string& text) { return loop::print(lower(text)); }

TEST(ShareRows, RowsThatDifferInFieldsAreOne) {
  EXPECT_EQ(text_of("kernel a(u: field halo 1, out v: field, k: param) { v = k*(u[-1] + u[+1]) }\n"
                    "kernel b(v: field halo 1, out w: field, k: param) { w = k*(v[-1] + v[+1]) }\n"
                    "program p { fill u periodic; run a; fill v periodic; run b; keep w }\n"),
            R"(params k
uniform k

row a {
  out v
  in u[-1], u[+1]
  v = k*(u[-1] + u[+1])
}

program p {
  axes x periodic
  inputs u
  fields v, w
  halo 1
  prepare fill u periodic
  sweep a then fill v periodic
  sweep a with u = v, v = w
  keep w
}
)");
}

TEST(ShareRows, NumbersAndUniformsThatDifferAreReadFromABlockOfTheSweep) {
  EXPECT_EQ(text_of("kernel a(u: field, out v: field, k: param) { v = sin(k*u + 2) + 3 }\n"
                    "kernel b(u: field, out w: field, q: param) { w = sin(0.5*u + q) + 3 }\n"
                    "kernel c(u: field, out x1: field, k: param) { x1 = sin(k*u + 2) + 3 }\n"
                    "program p { run a; run b; run c; keep v, w, x1 }\n"),
            R"(params k, q
uniform k
uniform q
uniform k_1 = k
uniform c_1 = 2
uniform c_2 = 0.5
uniform q_1 = q

row a {
  out v
  in u
  v = sin(k_1*u + c_1) + 3
}

program p {
  axes x periodic
  inputs u
  fields v, w, x1
  halo 0
  sweep a
  sweep a with v = w, k_1 = c_2, c_1 = q_1
  sweep a with v = x1
  keep v, w, x1
}
)");
}

TEST(ShareRows, UniformsThatFollowOneAnotherAreTheBlock) {
  const std::string both = text_of(
      "kernel a(u: field, out v: field, k, q: param) { v = k*u + q*u^2 }\n"
      "kernel b(u: field, out w: field, k, r: param) { w = k*u + r*u^2 }\n"
      "program p { run a; run b; keep v, w }\n");
  EXPECT_NE(both.find("  v = k*u + q*(u*u)\n"), std::string::npos) << both;
  EXPECT_NE(both.find("  sweep a\n  sweep a with v = w, q = r\n"), std::string::npos) << both;
  // k is one of those that differ, and one that both read.
  const std::string mixed = text_of(
      "kernel a(u: field, out v: field, k: param) { v = k*u + k*u^2 }\n"
      "kernel b(u: field, out w: field, k, r: param) { w = k*u + r*u^2 }\n"
      "program p { run a; run b; keep v, w }\n");
  EXPECT_NE(mixed.find("  v = k*u + k_1*(u*u)\n"), std::string::npos) << mixed;
  EXPECT_NE(mixed.find("  sweep a\n  sweep a with v = w, k_1 = r\n"), std::string::npos) << mixed;
}

TEST(ShareRows, ARowThatIsLikeNoOtherStaysAsItIs) {
  const std::string kernel = "kernel a(u: field, out v: field, k: param) { let b = 2*u; v = k*b + 3 }\n";
  const std::string alone = text_of(kernel + "program p { axes x periodic; run a; keep v }\n");
  const std::string twice =
      text_of(kernel + "program p { axes x periodic; run a; keep v }\nprogram q { axes x periodic; run a; keep v }\n");
  EXPECT_NE(alone.find("  let b = 2*u\n  v = k*b + 3\n"), std::string::npos) << alone;
  EXPECT_EQ(twice.find("with"), std::string::npos) << twice;
}

TEST(ShareRows, WhatDecidesTheCodeIsNotShared) {
  const auto rows = [](const std::string& a, const std::string& b) {
    return lower("kernel a(u, w: field halo 2, out v: field) { " + a +
                 " }\nkernel b(u, w: field halo 2, out q: field) { " + b + " }\nprogram p { fill u periodic; " +
                 ((a + b).find('w') == std::string::npos ? "" : "fill w periodic; ") + "run a; run b; keep v, q }\n")
        .rows.size();
  };
  EXPECT_EQ(rows("v = u*w", "q = w*u"), 1u);
  EXPECT_EQ(rows("v = 2*u + 1", "q = 3*w + 4"), 1u);
  EXPECT_EQ(rows("v = u^5", "q = u^7"), 2u);  // an exponent
  EXPECT_EQ(rows("v = u*w", "q = u*u"), 2u);  // one field in place of two: pointers of a row never meet
  EXPECT_EQ(rows("v = u*u[+1]", "q = u*w[+1]"), 2u);
  EXPECT_EQ(rows("v = u[+1]", "q = u[-1]"), 2u);  // an offset
  EXPECT_EQ(rows("v = sin(u)", "q = cos(u)"), 2u);
  EXPECT_EQ(rows("let b = u*w; v = b + 1/b", "let e = w*u; q = e + 2/e"), 1u);  // the name of a let
}

TEST(ShareRows, KindsOfAxesMatterToMasksOnly) {
  const std::string programs =
      "program p { axes x bounded; run a; keep v }\nprogram q { axes x bounded; run b; keep w }\n";
  EXPECT_EQ(lower("kernel a(u: field, out v: field) { v = u + 1 }\nkernel b(u: field, out w: field) { w = u + 1 }\n"
                  "program p { axes x bounded; run a; keep v }\nprogram q { axes x periodic; run b; keep w }\n")
                .rows.size(),
            1u);
  const std::string interp =
      "kernel a(u: field, out v: field) { v = interp(u, 0.3) }\nkernel b(u: field, out w: field) { w = interp(u, 0.3) "
      "}\n";
  EXPECT_EQ(lower(interp + "program p { fill u x = 0; run a; keep v }\nprogram q { fill u x = 0; run b; keep w }\n")
                .rows.size(),
            1u);
  EXPECT_EQ(lower(interp + "program p { fill u x = 0; run a; keep v }\nprogram q { fill u periodic; run b; keep w }\n")
                .rows.size(),
            2u);
}

TEST(ShareRows, SumsAndScattersAreBound) {
  const loop::Module module = lower(
      "kernel a(u: field, inout s: field, sum e: param) { e += 2*u; interp(s, u) += u }\n"
      "kernel b(w: field, inout r: field, sum f: param) { f += 5*w; interp(r, w) += w }\n"
      "kernel zero(out s: field, out r: field) { s = 0; r = 0 }\n"
      "program p { run zero; run a; run b; keep s, r }\n");
  EXPECT_EQ(module.rows.size(), 3u);
  const loop::Sweep& sums = std::get<loop::Sweep>(module.programs[0].body.at(3));
  EXPECT_EQ(sums.row, "a");
  EXPECT_EQ(sums.binding.sum("e"), "f");
  EXPECT_EQ(sums.binding.field("u"), "w");
  EXPECT_EQ(sums.binding.own, 1);
  const loop::Sweep& scatter = std::get<loop::Sweep>(module.programs[0].body.at(4));
  EXPECT_EQ(scatter.row, "a_scatter");
  EXPECT_EQ(scatter.binding.field("s"), "r");
  EXPECT_EQ(scatter.binding.own, 0);
}

TEST(ShareRows, TheVerifierLooksAtBindings) {
  const auto errors_after = [](auto change) {
    loop::Module module = lower(
        "kernel a(u: field, out v: field) { v = 2*u }\nkernel b(u: field, out w: field) { w = 3*u }\n"
        "program p { run a; run b; keep v, w }\n");
    change(std::get<loop::Sweep>(module.programs[0].body.at(1)).binding);
    return loop::verify(module);
  };
  using Errors = std::vector<std::string>;
  EXPECT_EQ(errors_after([](loop::Binding&) {}), Errors{});
  EXPECT_EQ(errors_after([](loop::Binding& b) { b.fields["v"] = "g"; }), Errors{"p: no field g"});
  EXPECT_EQ(errors_after([](loop::Binding& b) { b.fields["v"] = "u"; }),
            Errors{"p: a: v and u stand for the same field"});
  EXPECT_EQ(errors_after([](loop::Binding& b) { b.own = 2; }), Errors{"p: a: no such uniforms of its own"});
}

/// The text of one step in which c makes `parts` steps.
std::string text_of_subcycles(const std::string& parts) {
  const SourceFile source(
      "test.dpde",
      "model two {\n  field u, c\n  param k\n  dt(u) = lap(u) + c\n  dt(c) = k*(u - c^3) + lap(c)\n}\n"
      "scheme s { lap = central(2); time = rk2 }\n"
      "scene run : two with s {\n  grid x = 0 .. 1, cells 8, periodic\n  k = 2\n  initial u = sin(2*pi*x)\n"
      "  initial c = 1\n  time 0 .. 1, step 1/512\n  subcycle c in " +
          parts + "\n}\n");
  DiagnosticSink sink;
  const ast::File file = parse(source, sink);
  const auto problem = model::from_ast(file, {}, sink);
  const stencil::Module module =
      problem ? stencil::from_model(*problem, stencil::program_names(*problem), sink) : stencil::Module{};
  for (const Diagnostic& diagnostic : sink.all()) ADD_FAILURE() << diagnostic.message;
  return stencil::print(module) + loop::print(loop::from_stencil(module, {"run_step"}));
}

/// But for the number itself.
TEST(ShareRows, PartsOfAStepCostNoFurtherText) {
  const std::string seven = text_of_subcycles("7"), many = text_of_subcycles("400");
  EXPECT_NE(many.find("repeat part in 0 .. 400 {"), std::string::npos);
  EXPECT_EQ(std::ranges::count(many, '\n'), std::ranges::count(seven, '\n'));
  EXPECT_LE(many.size(), seven.size() + 2 * static_cast<std::size_t>(std::ranges::count(seven, '7')));
}

TEST(ShareRows, PassesCostNoFurtherRows) {
  const auto rows = [](int passes) {
    return lower(
               "kernel jacobi(u: field halo 1, b: field, out v: field, sum e: param, c: param) { let w = (b + c*(u[-1] "
               "+ u[+1]))/(1 + 2*c); v = w; e += (w - u)^2 }\n"
               "program p { repeat " +
               std::to_string(passes) + " { fill u x = 0; run jacobi; swap u, v } }\n")
        .rows.size();
  };
  EXPECT_EQ(rows(1), 1u);
  EXPECT_EQ(rows(100), 1u);
}

}  // namespace
}  // namespace dpde
