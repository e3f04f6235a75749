// SPDX-License-Identifier: Apache-2.0
// Lets that stand in several branches of selections: taken apart once, with the derivatives of the branches.
#include "adjoint/check/guards.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"
#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"

namespace dpde {
namespace {

using adjoint::any_of;
using adjoint::GuardedBar;
using adjoint::sum_of;
using stencil::Expr;

std::string text(const Expr& e) { return stencil::print(e, 1); }

TEST(Guards, AskEachConditionOnce) {
  const Expr a = stencil::local("a"), b = stencil::local("b");
  const std::vector<GuardedBar> both{{{{a, true}}, stencil::local("x")}, {{{a, false}}, stencil::local("y")}};
  EXPECT_EQ(text(sum_of(both)), "if(a, x, y)");
  EXPECT_EQ(text(any_of(both)), "1");
  const std::vector<GuardedBar> nested{
      {{{a, true}}, stencil::local("x")}, {{{a, false}, {b, true}}, stencil::local("y")}, {{}, stencil::local("z")}};
  EXPECT_EQ(text(sum_of(nested)), "z + if(a, x, if(b, y, 0))");
  EXPECT_EQ(text(any_of(nested)), "1");
  const std::vector<GuardedBar> two{{{{a, true}}, stencil::local("x")}, {{{b, false}}, stencil::local("y")}};
  EXPECT_EQ(text(any_of(two)), "max(if(a, 1, 0), if(b, 0, 1))");
}

struct GuardCase {
  std::string name, kernel;
};

/// Each let is used in several branches, under conditions that meet, exclude one another, or neither.
const GuardCase guard_cases[] = {
    {"both branches", "let a = sin(u)*c\n let b = u^2\n w = if(u > 1, a*b, a + b)"},
    {"one of three", "let a = sin(u)*c\n let b = a^2 + u*c\n w = if(u > 1.2, a, if(c > 1, b, b*a))"},
    {"neither", "let a = sin(u)*c + u*c*c*u*u*c\n w = if(u > 1, a, 0.2*u) + if(c > 1, a*u, 0)"},
    {"of each other",
     "let a = if(u > 0.8, u*c, c)\n let b = if(c > 0.9, a*a, 0.5*a)\n let d = if(u > c, b*a, a - b)\n "
     "w = if(c > 1.1, d*b, d*a) + if(u > 1.3, a, b)"},
    {"at neighbours",
     "let a = u*c[+1]\n let b = if(a > 1, a*u[-1], u)\n let d = if(u > 1, b, a)\n w = if(d > 0.9, d*b, a)"},
    {"params", "let a = if(u > 1, u*k, k)\n let b = if(c > 1, a*k, a)\n w = if(u > c, a*b, b)"}};

TEST(Guards, DerivativesAreThoseOfTheBranchesTaken) {
  for (const GuardCase& c : guard_cases) {
    const stencil::Module module =
        testing::parse_module("kernel f(u: field, c: field, out w: field, k: param) {\n " + c.kernel +
                              "\n}\nprogram p { fill u x.low = 0.7, x.high = zero_gradient; fill c x.low = 1.2, x.high "
                              "= zero_gradient; run f; swap u, w }\n");
    for (int cells = 1; cells <= 6; ++cells) {
      for (const std::uint64_t seed : {3, 4, 5}) {
        const testing::Check check = testing::check_derivatives(module, "p", {{"u", "c"}, {"k"}}, {1, {cells, 1, 1}},
                                                                seed + static_cast<std::uint64_t>(cells));
        EXPECT_LT(check.dot_product, 1e-12) << c.name;
        if (check.bend < 1e-3) EXPECT_LT(check.finite_difference, 1e-6) << c.name;
      }
    }
  }
}

/// What a branch that is not taken would make of it, a root of something negative, is in no derivative.
TEST(Guards, BranchesNotTakenMayBeNaN) {
  const stencil::Module module = testing::parse_module(
      "kernel f(u: field, out w: field) {\n let a = sqrt(u - 1)*u\n let b = a*a + u\n"
      " w = if(u > 1, b*a, if(u > 0.9, u, 2*u)) + if(u > 1, a, 0)\n}\nprogram p { run f; swap u, w }\n");
  for (const std::uint64_t seed : {1, 2, 3}) {
    const testing::Check check = testing::check_derivatives(module, "p", {{"u"}, {}}, {1, {7, 1, 1}}, seed);
    EXPECT_LT(check.dot_product, 1e-12);
    EXPECT_TRUE(std::isfinite(check.reverse));
  }
}

/// 40 lets, each used three times, in both branches: the adjoint is as long as they are.
TEST(Guards, GrowWithTheTextAlone) {
  const auto length_of = [](int lets) {
    std::string text = "let a0 = u\n";
    for (int i = 1; i <= lets; ++i)
      text += fmt::format(
          " let a{1} = if(a{0} > 0.{1}, sin(a{0}*u + 0.1*a{0})*u + tanh(a{0}*u), 0.5*a{0}*u*u + cos(a{0}))\n", i - 1,
          i);
    const stencil::Module module =
        testing::parse_module("kernel f(u: field, out w: field) {\n " + text +
                              fmt::format(" w = a{}\n}}\nprogram p {{ run f; swap u, w }}\n", lets));
    DiagnosticSink sink;
    return stencil::print(adjoint::adjoint(module, "p", {{"u"}, {}}, sink).module).size();
  };
  EXPECT_LT(static_cast<double>(length_of(40)), 5.0 * static_cast<double>(length_of(10)));
}

}  // namespace
}  // namespace dpde
