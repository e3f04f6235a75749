// SPDX-License-Identifier: Apache-2.0
// Where fills are placed: a program in which each stands where it has to be, and no other does, comes back from its
// rules letter by letter.
#include "stencil/analyse/verify_stencil.h"
#include "stencil_text.h"
#include "support/halo_rules.h"

namespace dpde::stencil {
namespace {

using testing::with_rules;

/// The statements of the first program.
std::string body_of(const Module& module) {
  const std::string text = print(module);
  const std::size_t begin = text.find("program p {\n") + 12;
  return text.substr(begin, text.find("\n}\n", begin) + 1 - begin);
}

const std::string rows = R"(
kernel centre(u: field, out v: field) { v = u^2 }
kernel around(u: field halo 1, out v: field) { v = u[+1] - 2*u[-1] }
kernel next(v: field halo 1, u: field, out w: field) { w = v[-1]*u }
kernel again(v: field halo 1, out r: field) { r = v[+1] + v }
kernel two(u: field halo 1, c: field halo 1, out v: field) { v = c[+1]*u[-1] }
kernel place(u: field halo 1, out v: field) { v = interp(u, u) }
kernel add(u: field, inout v: field) { v += 3*u }
kernel operator(q: field halo 1, c: field halo 1, out a: field) { a = 4*q + c[+1]*(q[-1] + q[+1]) }
)";

/// `fills`: how the text has them, each before the first read that needs it.
void expect_back(const std::string& text) {
  SCOPED_TRACE(text);
  const Module written = module_of(rows + text);
  Module module = with_rules(written);
  EXPECT_NE(verify(module), std::vector<std::string>{});
  place_fills(module);
  EXPECT_EQ(verify(module), std::vector<std::string>{});
  EXPECT_EQ(body_of(module), body_of(written));
}

TEST(PlaceFills, BeforeTheFirstReadAroundACell) {
  expect_back("program p { fill u periodic; run around; keep v }");
  expect_back("program p { fill u x = 2; run around; swap u, v }");
  expect_back("program p { fill u x = 2; run place; swap u, v }");
  expect_back("program p { fill u periodic; run around; fill v periodic; run next; swap u, w }");
  expect_back(
      "program p { run centre; fill u periodic; fill c periodic; run two_2; keep v, v_2 }\n"
      "kernel two_2(u: field halo 1, c: field halo 1, out v_2: field) { v_2 = c[+1]*u[-1] }");
}

TEST(PlaceFills, OnceForSeveralReads) {
  expect_back("program p { fill u periodic; run around; fill v periodic; run next; run again; keep w, r }");
}

TEST(PlaceFills, AgainBehindWhatChangesTheField) {
  expect_back(
      "program p { fill u periodic; run around; fill v periodic; run next; run add; fill v periodic; run again; "
      "keep w, r }");
}

/// A run beyond the walls reads there what it reads at its point; along a ring there is nothing beyond.
TEST(PlaceFills, BeforeARunThatGoesBeyondWalls) {
  expect_back("program p { fill u x = 0; run centre grow 1; run again; keep r }");
  Module module = module_of(rows + "program p { axes x periodic; run centre grow 1; keep v }");
  module.programs.front().halos = {rule_of_fill({"u", {AxisBoundary{}}})};
  place_fills(module);
  EXPECT_EQ(body_of(module), "  axes x periodic\n  run centre grow 1\n  keep v\n");
}

/// Behind inside[o] the point i+o is a cell, so that a read of i+o needs none and one of i+o+1 does.
TEST(PlaceFills, NotBeforeReadsThatMasksKeepInside) {
  const auto fills = [](const std::string& value, const std::string& axis, int grow) {
    Module module =
        module_of("kernel masked(u: field halo 2, out v: field) { v = " + value + " }\n" + "program p { fill u x" +
                  axis + "; run masked grow " + std::to_string(grow) + "; keep v }");
    module = with_rules(module);
    place_fills(module);
    EXPECT_EQ(verify(module), std::vector<std::string>{});
    return body_of(module).find("fill u") != std::string::npos;
  };
  EXPECT_FALSE(fills("if(inside[+1], u[+1], 0)", " = 2", 0));
  EXPECT_FALSE(fills("if(inside[+1] and u > 0, u[+1], u)", " = 2", 0));
  EXPECT_FALSE(fills("if(inside[-1], u[-1], 0)", " = 2", 1));
  EXPECT_TRUE(fills("if(inside[+1], u[+2], 0)", " = 2", 0));
  EXPECT_TRUE(fills("if(inside[+1], 0, u[+1])", " = 2", 0));
  EXPECT_TRUE(fills("if(inside[+1] or u > 0, u[+1], 0)", " = 2", 0));
  EXPECT_TRUE(fills("if(inside[+1], u[+1], u)", " = 2", 1));
  EXPECT_TRUE(fills("if(inside[+1], u[+1], 0)", " periodic", 0));
}

/// A pass begins with nothing filled, and what it fills of outside is anything behind it.
TEST(PlaceFills, InEachPassOfARepeatAndBehindIt) {
  expect_back("program p { repeat 3 { fill u x = 1; run around; swap u, v } to u_2; keep u_2 }");
  expect_back(
      "program p { fill c x = 1; run again_c; repeat 3 { fill u x = 1; fill c x = 1; run two; swap u, v } to u_2; "
      "fill c x = 1; run last; keep e, f, u_2 }\n"
      "kernel again_c(c: field halo 1, out e: field) { e = c[+1] }\n"
      "kernel last(c: field halo 1, out f: field) { f = c[-1] }");
  expect_back(
      "program p { repeat 2 { repeat 3 { fill u x = 1; run around; swap u, v } to u_2; fill u_2 x = 1; run on; "
      "swap u, w } to u_3; keep u_3 }\n"
      "kernel on(u_2: field halo 1, out w: field) { w = u_2[+1] }");
}

TEST(PlaceFills, InTheBlockOfASolveAndBehindIt) {
  expect_back(
      "program p { fill c x = 0; run right; solve a = b for q { fill q x = 0; fill c x = 0; run operator }; fill c x = "
      "0; "
      "fill q x = 3; run last; keep s }\n"
      "kernel right(c: field halo 1, out b: field) { b = c[+1] }\n"
      "kernel last(q: field halo 1, c: field halo 1, out s: field) { s = q[-1] + c[+1] }");
}

/// A fill sets values on walls, so that cells are read behind it too, by reductions as well.
TEST(PlaceFills, BeforeEachReadWhereValuesLieOnWalls) {
  expect_back("program p { fill u x = on_wall(2); run centre; keep v }");
  expect_back(
      "program p { fill u x = on_wall(2); reduce m = sum u over x; run of_sum; keep s }\n"
      "kernel of_sum(m: field, out s: field) { s = 2*m }");
}

/// What needs no fill has none, whatever the text had.
TEST(PlaceFills, LeavesOutWhatNobodyReads) {
  Module module = with_rules(module_of(
      rows + "program p { fill u x = 0; run centre; fill v x = 0; fill u x = 0; run again; fill v x = 0; keep r }"));
  place_fills(module);
  EXPECT_EQ(body_of(module), "  run centre\n  fill v x = 0\n  run again\n  keep r\n");
}

AxisBoundary on_walls(const Expr& low) {
  AxisBoundary axis{Topology::bounded, {SideKind::gradient, low}, {SideKind::gradient, 0.0}};
  axis.low.on_wall = axis.high.on_wall = true;
  return axis;
}

/// Values on a wall that follow from those beside them are part of a result, and a block that fills leaves others.
TEST(PlaceFills, BehindAllWhereResultsNeedIt) {
  const auto body = [](const std::string& text, FillNeed need) {
    Module module = module_of(rows + text);
    module.programs.front().halos = {{Fill{"v", {on_walls(0.0)}}, need}};
    place_fills(module);
    return body_of(module);
  };
  const std::string text = "program p { axes x bounded; run centre; swap u, v }";
  EXPECT_EQ(body(text, FillNeed::reads), "  axes x bounded\n  run centre\n  swap u, v\n");
  EXPECT_EQ(body(text, FillNeed::results), "  run centre\n  fill v x = on_wall(gradient(0))\n  swap u, v\n");
  Module module =
      module_of(rows +
                "program p { run centre; fill v x = on_wall(gradient(0)); repeat 2 { fill v x = "
                "on_wall(gradient(0)); run more; swap z, w } to z_2; fill v x = on_wall(gradient(0)); keep v, z_2 }\n"
                "kernel more(v: field halo 1, z: field, out w: field) { w = z + v[+1] }");
  const std::string expected = body_of(module);
  module.programs.front().body = {module.programs.front().body[0], module.programs.front().body[2]};
  EXPECT_NE(verify(module), std::vector<std::string>{});
  module.programs.front().halos = {{Fill{"v", {on_walls(0.0)}}, FillNeed::reads}};
  place_fills(module);
  EXPECT_EQ(body_of(module), expected);
}

/// Of seeds a program knows what lies beyond walls: a fill there would be wrong.
TEST(PlaceFills, AroundRingsAlone) {
  const std::string text =
      "kernel along_x(b: field halo 1, out r: field) { r = b[+1, 0] }\n"
      "kernel along_y(r: field halo 1, out s: field) { s = r[0, +1] }\n"
      "program p { axes x bounded, y periodic; run begin grow 1; run along_x; run along_y; keep s }\n"
      "kernel begin(u: field, out b: field) { b = 3*u }";
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  Module module = from_ast(parse(source, sink), sink);  // that r has no fill is told
  const AxisBoundary wall{Topology::bounded, {SideKind::zero_gradient, 0.0}, {SideKind::zero_gradient, 0.0}};
  for (const std::string field : {"b", "r"})
    module.programs.front().halos.push_back({Fill{field, {wall, AxisBoundary{}}}, FillNeed::around});
  place_fills(module);
  EXPECT_EQ(body_of(module),
            "  run begin grow 1\n  run along_x\n  fill r x = zero_gradient, y periodic\n  run along_y\n  keep s\n");
}

/// The fields of its walls come first.
TEST(PlaceFills, FromWhereTheWallIsKnown) {
  expect_back(
      "program p { run wall grow 1; fill u x = u_wall; run around; keep v }\n"
      "kernel wall(x: field, out u_wall: field) { u_wall = sin(x) }");
  Module module = module_of(rows +
                            "program p { reduce m = mean u over x; run wall grow 1; fill u x = u_wall; run "
                            "around; run of_mean; keep v, s }\n"
                            "kernel wall(x: field, out u_wall: field) { u_wall = sin(x) }\n"
                            "kernel of_mean(m: field, out s: field) { s = 2*m }");
  const std::string expected = body_of(module);
  module = with_rules(module);
  module.programs.front().halos.front().need = FillNeed::reads;
  place_fills(module);
  EXPECT_EQ(body_of(module), expected);
}

}  // namespace
}  // namespace dpde::stencil
