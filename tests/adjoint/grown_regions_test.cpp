// SPDX-License-Identifier: Apache-2.0
// Statements that meet at walls in ways the lowering of models does not bring about, as random programs found them:
// scatters that are not folded, folds of what was filled, coordinates and added-to fields read by the adjoint alone.
#include <gtest/gtest.h>

#include <algorithm>

#include "stencil/analyse/verify_stencil.h"
#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"

namespace dpde {
namespace {

using adjoint::Activity;

struct Case {
  const char* what;
  int rank;
  const char* text;
  Activity wrt;
};

void expect_right(const Case& c) {
  SCOPED_TRACE(c.what);
  const stencil::Module module = testing::parse_module(c.text);
  double magnitude = 0;
  for (const stencil::Grid& grid : testing::small_grids(c.rank)) {
    const auto check = testing::check_derivatives(module, "p", c.wrt, grid, 99);
    EXPECT_LT(check.dot_product, 1e-12) << grid.cells[0] << " x " << grid.cells[1];
    EXPECT_LT(check.finite_difference, 1e-6) << grid.cells[0] << " x " << grid.cells[1];
    magnitude = std::max(magnitude, check.magnitude);
  }
  EXPECT_GT(magnitude, 0.1);
}

const Case grown_cases[] = {
    {"a scatter to a result next to walls",
     1,
     "kernel zero(out w: field) { w = 1 }\n"
     "kernel add(v: field, q: field, inout w: field) { interp(w[+1], v) += q }\n"
     "program p { axes x bounded; run zero; run add; keep w }",
     {{"v", "q"}, {}}},
    {"a scatter to what is read later",
     1,
     "kernel zero(v: field, out w: field) { w = v }\n"
     "kernel add(v: field, inout w: field) { interp(w, 0.7*v) += v^2 }\n"
     "kernel use(w: field halo 1, out r: field) { r = w[+1]*w }\n"
     "program p { axes x bounded; run zero; run add; fill w x = zero_gradient; run use; keep r }",
     {{"v"}, {}}},
    {"a scatter along a periodic axis and a bounded one",
     2,
     "kernel zero(out w: field) on 2 axes { w = 1 }\n"
     "kernel add(v: field, inout w: field) { interp(w[0, +1], 1.3*v, v) += v }\n"
     "program p { axes x periodic, y bounded; run zero; run add; keep w }",
     {{"v"}, {}}},
    {"a fold of what was filled, farther out than the fold",
     1,
     "kernel k(v: field, out w: field) { w = v^2 }\n"
     "program p { fill v x = 0.3; run k grow 2; fill w x = zero_gradient; fold w grow 1 x = zero_gradient; keep w }",
     {{"v"}, {}}},
    {"a scatter onto a wall, read by the adjoint around a periodic axis",
     2,
     "kernel k(out w: field) on 2 axes { w = 1 }\n"
     "kernel add(inout w: field) { interp(w, 1, 1) += 1 }\n"
     "kernel use(w: field, u: field halo 1, out r: field) { r = w*u[-1, 0] }\n"
     "program p { axes x periodic, y bounded; fill u x periodic, y = zero_gradient; run k; fill w x periodic, y = "
     "on_wall(1.4)\n"
     "run add; run use; keep r }",
     {{"u"}, {}}},
    {"a fold on walls of what is added to later",
     1,
     "kernel k(v: field, out w: field) { w = v^2 }\n"
     "kernel add(u: field, inout w: field) { w += u }\n"
     "program p { axes x bounded; run k; fold w grow 0 x = on_wall(mixed(1, 2, 0)); run add; keep w }",
     {{"u", "v"}, {}}},
    {"a result that is filled and not read",
     1,
     "kernel k(v: field, out w: field) { w = v^2 }\n"
     "kernel l(v: field halo 1, out r: field) { r = v[+1]*v }\n"
     "program p { fill v x = 0.3; run k; run l; fill w x = 0.1; keep w, r }",
     {{"v"}, {}}},
    {"coordinates at neighbours around a periodic axis",
     2,
     "kernel k(x: field halo 1, y: field halo 1, u: field halo 1, out w: field, a: param) { w = a*(x[-1, 0] - y[0, "
     "-1])*u[0, +1] }\n"
     "program p { fill u x = 0.2, y periodic; run k; keep w }",
     {{"u"}, {"a"}}},
    {"reads behind inside[] beyond walls",
     1,
     "kernel k(u: field, out w: field) { w = u^2 }\n"
     "kernel l(w: field, out r: field, out q: field) {\n"
     "  r = if(inside[+1] grow 1, w[+1], 0); q = if(inside[-1] grow 2 and inside[+1], w[-1]*w[+1], w)\n"
     "}\n"
     "program p { fill u x = 0.4; run k grow 2; run l; keep r, q }",
     {{"u"}, {}}},
    {"a halo filled once more from what is linear in it",
     1,
     "kernel k(u: field halo 1, out w: field) { w = 2*u[+1] }\n"
     "kernel l(u: field halo 1, out r: field) { r = u[-1] }\n"
     "program p { fill u x = 0.3; run k; fill u x = 0.7; run l; keep w, r }",
     {{"u"}, {}}},
    {"a field that is filled, added to, and then read beside neighbours",
     2,
     "kernel one(u: field, out w: field) on 2 axes { w = u }\n"
     "kernel add(v: field, inout w: field) on 2 axes { w += v }\n"
     "kernel use(w: field, u: field halo 1, out r: field) { r = w*u[0, +1] }\n"
     "program p { fill u x = zero_gradient, y periodic; run one; fill w x = zero_gradient, y periodic; run add; run "
     "use; keep r }",
     {{"u", "v"}, {}}},
};

TEST(GrownRegions, AdjointIsTheTransposeOfTheTangent) {
  for (const Case& c : grown_cases) expect_right(c);
}

struct Refused {
  const char* what;
  const char* code;
  const char* message;
  const char* text;
};

const Refused refused[] = {
    {"neighbours around a periodic axis on a grown region", "E0601",  // no fill leaves alone what lies beyond the walls
     "reading neighbours around a periodic axis for w, which is read beyond walls in kernel k has no derivative that "
     "is of use",
     "kernel k(u: field halo 1, out w: field) { w = u[-1, 0]^2 }\n"
     "kernel l(w: field halo 1, out r: field) { r = w[0, +1] }\n"
     "program p { fill u x periodic, y = zero_gradient; run k grow 1; run l; keep r }"},
    {"the wall of a fill that is folded and then the wall of another",
     "E0601",  // the fold's transpose is as wide as the fold
     "w at the walls of v before it is folded or filled in kernel p has no derivative that is of use",
     "kernel k(u: field, out w: field, out v: field, out q: field) { w = u^2; v = 2*u; q = u }\n"
     "kernel l(v: field halo 2, out r: field) { r = v[+2] }\n"
     "kernel m(q: field halo 1, out s: field) { s = q[-1] }\n"
     "program p { fill u x = 0; run k grow 2; fill v x = w; run l; fold w grow 1 x = zero_gradient; fill q x = w; run "
     "m; keep r, s }"},
    {"added to around a periodic axis after it is read on a grown region", "E0601",  // its halo holds copies by then
     "reading w beyond walls before it is added to or folded in kernel l has no derivative that is of use",
     "kernel k(u: field, out w: field) on 2 axes { w = u }\n"
     "kernel l(w: field, out r: field) on 2 axes { r = w }\n"
     "kernel add(u: field halo 1, inout w: field) { w += u[+1, 0] }\n"
     "program p { fill u x periodic, y = 0; run k; fill w x periodic, y = zero_gradient; run l grow 1; run add; keep "
     "w, r }"},
    {"a halo filled once more and otherwise", "E0603",  // recomputed, it would be the last one
     "the derivative of kernel k needs field u as it was before it is changed again",
     "kernel k(u: field halo 1, out w: field) { w = u[+1]^2 }\n"
     "kernel l(u: field halo 1, out r: field) { r = u[-1] }\n"
     "program p { fill u x = 0.3; run k; fill u x = 0.7; run l; keep w, r }"},
};

TEST(GrownRegions, WhatWouldBeWrongIsRefused) {
  for (const Refused& one : refused) {
    SCOPED_TRACE(one.what);
    const stencil::Module module = testing::parse_module(one.text);
    DiagnosticSink sink;
    adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
    ASSERT_TRUE(sink.has_errors());
    EXPECT_EQ(sink.all()[0].kind->code, one.code);
    EXPECT_EQ(sink.all()[0].message, one.message);
  }
}

/// A state that the step replaces without reading it has a derivative whose text reads back.
TEST(GrownRegions, AStateThatIsNotReadSwapsStill) {
  const stencil::Module module = testing::parse_module(
      "kernel k(u: field, out w: field, out r: field) { w = if(u > 1, 2, 3); r = u^2 }\nprogram p { run k; swap v, w; "
      "keep r }");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", {{"u", "v"}, {}}, sink);
  ASSERT_FALSE(sink.has_errors());
  EXPECT_EQ(stencil::print(testing::parse_module(stencil::print(derived.module))), stencil::print(derived.module));
}

}  // namespace
}  // namespace dpde
