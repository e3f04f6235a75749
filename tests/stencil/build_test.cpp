// SPDX-License-Identifier: Apache-2.0
// Smart constructors, traversals and signatures, seen through the text of their results.
#include "stencil/build.h"

#include <gtest/gtest.h>

#include "stencil/text/print_stencil.h"
#include "stencil_text.h"

namespace dpde::stencil {
namespace {

const Expr a = param("a"), b = param("b"), c = param("c"), u = access("u");
std::string text(const Expr& e) { return print(e, 1); }

TEST(Build, FoldsNumbers) {
  EXPECT_EQ(text(Expr(2.0) + 3.0), "5");
  EXPECT_EQ(text(Expr(2.0) * 3.0 - 1.0), "5");
  EXPECT_EQ(text(power(2.0, 10.0)), "1024");
  EXPECT_EQ(text(call(Fn::max, {2.0, 3.0})), "3");
  EXPECT_EQ(text(call(Fn::sqrt, {9.0})), "3");
  EXPECT_EQ(text(call(Fn::exp, {0.0})), "1");
  EXPECT_EQ(text(binary(BinaryOp::less, 1.0, 2.0)), "1");
}

TEST(Build, LeavesAloneWhatIsNotFiniteOrNotExact) {
  EXPECT_EQ(text(Expr(1.0) / 0.0), "1/0");
  EXPECT_EQ(text(Expr(0.0) / 0.0), "0/0");
  EXPECT_EQ(text(call(Fn::log, {0.0})), "log(0)");
  EXPECT_EQ(text(call(Fn::sqrt, {-1.0})), "sqrt(-1)");
  EXPECT_EQ(text(call(Fn::sin, {1.0})), "sin(1)");
  EXPECT_EQ(text(a + b + 1.0 + 2.0), "a + b + 1 + 2");  // no reassociation
}

TEST(Build, NeutralElements) {
  EXPECT_EQ(a + 0.0, a);
  EXPECT_EQ(Expr(0.0) + a, a);
  EXPECT_EQ(a - 0.0, a);
  EXPECT_EQ(a * 1.0, a);
  EXPECT_EQ(Expr(1.0) * a, a);
  EXPECT_EQ(a / 1.0, a);
  EXPECT_EQ(a * 0.0, Expr(0.0));
  EXPECT_EQ(Expr(0.0) / a, Expr(0.0));
  EXPECT_EQ(power(a, 1.0), a);
  EXPECT_EQ(power(a, 0.0), Expr(1.0));
  EXPECT_EQ(text(power(a, 2.0)), "a^2");
}

TEST(Build, SignsMoveOutwardsAndIntoLeadingNumbers) {
  EXPECT_EQ(text(Expr(0.0) - a), "-a");
  EXPECT_EQ(-(-a), a);
  EXPECT_EQ(a * -1.0, -a);
  EXPECT_EQ(-a * b, -(a * b));
  EXPECT_EQ(a * -b, -(a * b));
  EXPECT_EQ(-a * -b, a * b);
  EXPECT_EQ(-a / b, -(a / b));
  EXPECT_EQ(a / -b, -(a / b));
  EXPECT_EQ(text(a + -b), "a - b");
  EXPECT_EQ(text(a - -b), "a + b");
  EXPECT_EQ(text(-a + b), "b - a");
  EXPECT_EQ(text(-(Expr(2.0) * a * b)), "-2*a*b");
  EXPECT_EQ(text(c - Expr(-2.0) * a * b), "c + 2*a*b");
  EXPECT_EQ(text(c + Expr(-2.0)), "c - 2");
}

TEST(Build, SelectsAndConditions) {
  const Expr condition = inside({1}, 0);
  EXPECT_EQ(select(1.0, a, b), a);
  EXPECT_EQ(select(0.0, a, b), b);
  EXPECT_EQ(select(condition, a, a), a);
  EXPECT_EQ(select(condition, 0.0, 0.0), Expr(0.0));
  EXPECT_EQ(select(condition, select(condition, a, b), c), select(condition, a, c));
  EXPECT_EQ(select(condition, a, select(condition, b, c)), select(condition, a, c));
  EXPECT_EQ(binary(BinaryOp::logical_and, condition, 1.0), condition);
  EXPECT_EQ(binary(BinaryOp::logical_and, condition, 0.0), Expr(0.0));
  EXPECT_EQ(binary(BinaryOp::logical_or, condition, 1.0), Expr(1.0));
  EXPECT_EQ(text(binary(BinaryOp::logical_and, a, 1.0)), "a and 1");  // a may be 2, the result is 1
  EXPECT_EQ(call(Fn::min, {a, a}), a);
}

TEST(Build, ShiftMovesEverythingAtThePoint) {
  const Expr e = u + local("l") * inside({-1}, 2) + interp({"v", {}, {u}, {}});
  const Expr shifted = shift(e, {2}, [](const std::string& name) { return name + "_p2"; });
  EXPECT_EQ(text(shifted), "u[+2] + l_p2*inside[+1] grow 2 + interp(v[+2], u[+2])");
}

TEST(Build, SubstitutesAndRenames) {
  EXPECT_EQ(text(substitute_params(a * u + b, {{"a", Expr(0.0)}})), "b");
  const auto barred = [](const std::string& name) { return name + "_bar"; };
  EXPECT_EQ(text(rename_fields(access("u", {1}) + interp({"v", {}, {u}, {}}) + a, barred)),
            "u_bar[+1] + interp(v_bar, u_bar) + a");
}

const char* const two_axes =
    R"(kernel k(u: field halo 2, v: field, w: field, out r: field, inout w_bar: field, sum s: param, c: param) {
  let d = v
  r = u[+2, -1] + interp(w, d, c)
  s += u
  interp(w_bar, d, c) += u
}

program p {
  axes x periodic, y bounded
  fill u x periodic, y = b
  fill w x periodic, y = zero_gradient
  fill v x periodic, y = 0
  run z grow 1
  run k grow 1
  fold w_bar grow 1 x periodic, y = 0
  swap w, w_bar
  keep r
}

kernel z(out w_bar: field) on 2 axes {
  w_bar = 0
}
)";

TEST(Signature, OfAKernel) {
  const Module m = module_of(two_axes);
  const Signature s = signature(*m.find_kernel("k"));
  ASSERT_EQ(s.reads.size(), 3u);
  EXPECT_EQ(s.reads[0].field, "v");
  EXPECT_EQ(s.find_read("u")->halo, (std::array<int, 3>{2, 1, 0}));
  EXPECT_EQ(s.find_read("w")->halo, (std::array<int, 3>{1, 1, 0}));
  EXPECT_TRUE(s.find_read("w")->interpolated);
  EXPECT_EQ(s.find_read("w_bar"), nullptr);
  EXPECT_EQ(s.writes, std::vector<std::string>{"r"});
  EXPECT_EQ(s.updates, std::vector<std::string>{"w_bar"});
  EXPECT_EQ(s.params, std::vector<std::string>{"c"});
  EXPECT_EQ(s.sums, std::vector<std::string>{"s"});
}

TEST(Signature, InterfaceAndHaloOfAProgram) {
  const Module m = module_of(two_axes);
  const Interface i = interface_of(m, *m.find_program("p"));
  EXPECT_EQ(i.inputs, (std::vector<std::string>{"u", "w", "v"}));
  EXPECT_EQ(i.written, (std::vector<std::string>{"w_bar", "r"}));
  EXPECT_EQ(i.params, (std::vector<std::string>{"b", "c"}));
  EXPECT_EQ(i.sums, std::vector<std::string>{"s"});
  const auto halo = required_halo(m, *m.find_program("p"));
  EXPECT_EQ(halo.at("u"), (std::array<int, 3>{2, 2, 0}));  // offset 1 and grown by 1 along bounded y
  EXPECT_EQ(halo.at("v"), (std::array<int, 3>{0, 1, 0}));
  EXPECT_EQ(halo.at("w"), (std::array<int, 3>{0, 1, 0}));  // wraps along x, clamped to one cell along y
  EXPECT_EQ(halo.at("w_bar"), (std::array<int, 3>{0, 1, 0}));
  EXPECT_EQ(halo.at("r"), (std::array<int, 3>{0, 1, 0}));
}

/// What a program refills alike keeps its values for the adjoint.
TEST(Boundaries, SidesOfPeriodicAxesAreNotLookedAt) {
  const Side wall{SideKind::value, 2.0};
  EXPECT_EQ((AxisBoundary{Topology::periodic, wall, {}}), AxisBoundary{});
  EXPECT_NE((AxisBoundary{Topology::bounded, wall, {}}), (AxisBoundary{Topology::bounded, {}, {}}));
}

}  // namespace
}  // namespace dpde::stencil
