// SPDX-License-Identifier: Apache-2.0
// What operators mean over the axes of a scene, lets, vectors, conditions, and what is dropped.
#include "model/build.h"
#include "model/from_ast/formulas/built_ins.h"
#include "model/model_support.h"

namespace dpde::model {
namespace {

TEST(Expressions, EachElementaryFunctionHasARow) {
  for (const Fn fn : every_function()) EXPECT_NE(formulas::find_built_in(name_of(fn)), nullptr) << name_of(fn);
}

TEST(Operators, LaplacianRangesOverTheAxes) {
  EXPECT_EQ(rhs_of("lap(u)", 1), "d(u, x, 2)");
  EXPECT_EQ(rhs_of("lap(u)", 2), "d(u, x, 2) + d(u, y, 2)");
  EXPECT_EQ(rhs_of("lap(u)", 3), "d(u, x, 2) + d(u, y, 2) + d(u, z, 2)");
  EXPECT_EQ(rhs_of("k*lap(lap(u))", 1), "k*d(d(u, x, 2), x, 2)");
}

TEST(Operators, DerivativesAlongOneAxis) {
  EXPECT_EQ(rhs_of("dx(u) + dy(u)", 2), "dx(u) + dy(u)");
  EXPECT_EQ(rhs_of("d(u, y) + d(u, x, 1) + d(u, z, 2)", 3), "dy(u) + dx(u) + d(u, z, 2)");
  EXPECT_EQ(rhs_of("d(u, x, 3)"), "dx(d(u, x, 2))");
  EXPECT_EQ(rhs_of("d(u, x, 4)"), "d(d(u, x, 2), x, 2)");
  EXPECT_EQ(rhs_of("dx(u*w)"), "dx(u*w)");
}

TEST(Operators, DivergenceAndGradient) {
  EXPECT_EQ(rhs_of("div(w*grad(u))", 1), "dx(w*dx(u))");
  EXPECT_EQ(rhs_of("div(w*grad(u))", 2), "dx(w*dx(u)) + dy(w*dy(u))");
  EXPECT_EQ(rhs_of("div((u, k*u))", 2), "dx(u) + dy(k*u)");
  EXPECT_EQ(rhs_of("div(u*(1, 2, 3)/k)", 3), "dx(u/k) + dy(u*2/k) + dz(u*3/k)");
  EXPECT_EQ(rhs_of("dot(grad(u), grad(u))", 2), "dx(u)*dx(u) + dy(u)*dy(u)");
  EXPECT_EQ(rhs_of("dot((u, k), (k, u))", 3), "u*k + k*u");
}

TEST(Operators, Advection) {
  EXPECT_EQ(rhs_of("-advect(u, u)", 1), "-advect(u, u)");
  EXPECT_EQ(rhs_of("-advect((u, k), u)", 2), "-advect((u, k), u)");
  EXPECT_EQ(rhs_of("-advect(-grad(w), u)", 2), "-advect((-dx(w), -dy(w)), u)");
  EXPECT_EQ(rhs_of("div(advect((u, k), (u, w)))", 2), "dx(advect((u, k), u)) + dy(advect((u, k), w))");
}

TEST(Operators, DerivativesOfWhatDoesNotVaryAreZero) {
  EXPECT_EQ(rhs_of("u + dx(k) + lap(t*c) + advect(u, k)"), "u");
  EXPECT_EQ(rhs_of("u + dx(x)"), "u + dx(x)");
}

TEST(Functions, OfNumbers) {
  EXPECT_EQ(rhs_of("min(u, 2) + max(abs(u), sign(k)) + floor(exp(-u^2))"),
            "min(u, 2) + max(abs(u), sign(k)) + floor(exp(-u^2))");
  EXPECT_EQ(rhs_of("sin(2*pi*x) + t + y", 2), "sin(2*pi*x) + t + y");
}

TEST(Functions, Choices) {
  EXPECT_EQ(rhs_of("if(u > 0, u, -u)"), "if(u > 0, u, -u)");
  EXPECT_EQ(rhs_of("if(not (u > 0 and x <= 1/2 or u == k), 2, u)"), "if((u <= 0 or x > 1/2) and u != k, 2, u)");
  EXPECT_EQ(rhs_of("div(if(u > 0, (u, k), (k, u)))", 2), "dx(if(u > 0, u, k)) + dy(if(u > 0, k, u))");
}

TEST(Lets, ArePutIn) {
  EXPECT_EQ(rhs_of("-div(flux) + s", 2, "  let s = u^2 + k\n  let flux = (s, -s)\n"),
            "-(dx(u^2 + k) + dy(-(u^2 + k))) + (u^2 + k)");
  EXPECT_EQ(rhs_of("if(wet, u, 0)", 1, "  let wet = u > c\n"), "if(u > c, u, 0)");
}

TEST(Lets, MayBeReadByObservables) {
  const Problem p = problem_of(text_with("u", 1, "  observe e = integral(s)/2 - 3*mean(s*x)\n", "  let s = u^2\n"));
  ASSERT_EQ(p.observables.size(), 1u);
  EXPECT_EQ(p.observables[0].name, "e");
  EXPECT_EQ(print(p.observables[0].value), "integral(u^2)/2 - 3*mean(u^2*x)");
}

TEST(Text, KeepsTheMeaningOfParentheses) {
  EXPECT_EQ(rhs_of("u - (k - c) - (u + 2)"), "u - (k - c) - (u + 2)");
  EXPECT_EQ(rhs_of("(u^2)^3 + u^2^3 + (-u)^2 - u^(-k)"), "(u^2)^3 + u^2^3 + (-u)^2 - u^(-k)");
  EXPECT_EQ(rhs_of("u/(k*c)*(u/k)"), "u/(k*c)*(u/k)");
  EXPECT_EQ(rhs_of("-(u + k)*u"), "-(u + k)*u");
}

// ---- what a zero drops ---------------------------------------------------------------------------------------------

Problem with_values(const std::string& k, const std::string& c, const std::string& rhs,
                    const std::string& model_lines = "") {
  return problem_of(text_with(rhs, 2, "", model_lines), {"", {{"k", k}, {"c", c}}, ""});
}

TEST(Dropping, TermsWithAFactorZero) {
  const Problem p = with_values("0", "3", "-advect((u, c), u) + k*lap(u) + w");
  EXPECT_EQ(print(*p.states[0].rhs), "-advect((u, c), u) + w");
  EXPECT_EQ(p.remarks.dropped, std::vector<std::string>{"k*lap(u) in dt(u): k is 0"});
}

TEST(Dropping, OneIsPutInAsWell) {
  const Problem p = with_values("1", "3", "k*w*lap(u) - (1 - k)*c*u + u^k");
  EXPECT_EQ(print(*p.states[0].rhs), "w*(d(u, x, 2) + d(u, y, 2)) + u");
  EXPECT_EQ(p.remarks.dropped, std::vector<std::string>{"(1 - k)*c*u in dt(u): k is 1"});
}

TEST(Dropping, WholeRightHandSide) {
  const Problem p = with_values("0", "0", "k*(lap(u) + c*u*w)");
  EXPECT_EQ(print(*p.states[0].rhs), "0");
  ASSERT_FALSE(p.remarks.dropped.empty());
  EXPECT_EQ(p.remarks.dropped[0], "k*(lap(u) + c*u*w) in dt(u): c is 0, k is 0");
  EXPECT_EQ(p.remarks.dropped.size(), 2u);  // and the coefficient
  EXPECT_EQ(p.remarks.dropped[1], "coefficient w: nothing reads it");
}

TEST(Dropping, InsideOfBracketsAndLets) {
  const Problem p = with_values("0", "3", "w*(s + k*u)", "  let s = c*u + k*u^2\n");
  EXPECT_EQ(print(*p.states[0].rhs), "w*(c*u)");
  EXPECT_EQ(p.remarks.dropped, (std::vector<std::string>{"k*u^2 in let s: k is 0", "k*u in dt(u): k is 0"}));
}

TEST(Dropping, ZerosThatAreWrittenAreNotWorthAWord) {
  const Problem p = with_values("2", "3", "0 + k*c*w*u");
  EXPECT_EQ(print(*p.states[0].rhs), "k*c*w*u");
  EXPECT_TRUE(p.remarks.dropped.empty());
}

TEST(Dropping, UnknownsStay) {
  const std::string text =
      text_with("k*lap(u) + c*w*u") + "task t : s {\n  unknown k from 1\n  minimise mean(u^2)\n}\n";
  const Problem p = problem_of(text, {"", {{"k", "0"}, {"c", "1"}}, ""});
  EXPECT_EQ(print(*p.states[0].rhs), "k*d(u, x, 2) + w*u");
  EXPECT_EQ(p.find_param("k")->value, 0);
  EXPECT_TRUE(p.find_param("k")->unknown);
  EXPECT_FALSE(p.find_param("c")->unknown);
}

// ---- constructors --------------------------------------------------------------------------------------------------

TEST(Build, Identities) {
  const Expr u = field("u");
  EXPECT_EQ(binary(BinaryOp::multiply, 0.0, u), Expr(0.0));
  EXPECT_EQ(binary(BinaryOp::multiply, u, 1.0), u);
  EXPECT_EQ(binary(BinaryOp::add, 0.0, u), u);
  EXPECT_EQ(binary(BinaryOp::subtract, 0.0, u), negate(u));
  EXPECT_EQ(binary(BinaryOp::divide, u, 1.0), u);
  EXPECT_EQ(binary(BinaryOp::power, u, 0.0), Expr(1.0));
  EXPECT_EQ(negate(negate(u)), u);
  EXPECT_EQ(print(binary(BinaryOp::divide, 0.0, 0.0)), "0/0");
  EXPECT_EQ(print(binary(BinaryOp::add, 1.0, 2.0)), "1 + 2");
  EXPECT_EQ(derivative(param("k"), 0, 1), Expr(0.0));
  EXPECT_EQ(advect({0.0, 0.0}, u), Expr(0.0));
  EXPECT_FALSE(field("u") == field("v"));
}

TEST(Build, SizeIsThatOfTheTree) {
  Expr e = field("u");
  for (int i = 0; i < 60; ++i) e = binary(BinaryOp::add, e, e);  // 2^61 - 1 nodes that share
  EXPECT_TRUE(is_larger_than(e, 1000, 1000));
  EXPECT_TRUE(is_larger_than(e, 1000000, 60));
  EXPECT_FALSE(is_larger_than(binary(BinaryOp::add, field("u"), field("v")), 3, 2));
  EXPECT_TRUE(is_larger_than(binary(BinaryOp::add, field("u"), field("v")), 2, 2));
}

}  // namespace
}  // namespace dpde::model
