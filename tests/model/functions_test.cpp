// SPDX-License-Identifier: Apache-2.0
// Functions and operators of the file: what they become, and what is refused.
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// The right-hand side of u's equation in a file that begins with these definitions.
std::string with(const std::string& definitions, const std::string& rhs, int axes = 1) {
  return print(*problem_of(definitions + text_with(rhs, axes)).states.at(0).rhs);
}

std::string message_at(const std::string& definitions, const std::string& rhs, int axes = 1) {
  const Outcome outcome = outcome_of(definitions + text_with(rhs + " + 0*w*k*c", axes));
  if (outcome.diagnostics.size() != 1) return outcome.code_and_hint();
  return outcome.diagnostics[0].message + " | " + outcome.diagnostics[0].hint;
}

TEST(Functions, ArePutInWhereTheyAreCalled) {
  EXPECT_EQ(with("function f(a, b) = a*b + 1\n", "f(u, k) + f(w, c)"), "u*k + 1 + (w*c + 1)");
  EXPECT_EQ(with("function f(a) = g(a) + a\nfunction g(b) = 2*b\n", "f(f(u)) + 0*w*k*c"), "2*(2*u + u) + (2*u + u)");
  EXPECT_EQ(with("function f(x) = x^2 + y\n", "f(u) + 0*w*k*c", 2), "u^2 + y");
  EXPECT_EQ(with("function f(v) = dot(v, v) + v.y\n", "f((u, w)) + 0*k*c", 2), "u*u + w*w + w");
  EXPECT_EQ(with("function flux(a) = -k1(a)*grad(a)\nfunction k1(a) = 1 + a\n", "div(flux(u)) + 0*w*k*c"),
            "dx(-(1 + u)*dx(u))");
}

TEST(Functions, AlsoOfNumbersAndInitialStates) {
  const std::string text =
      "function f(a) = 2*a\nmodel m { field u; param k; dt(u) = -k*u }\nscene s : m {\n"
      "  grid x = 0 .. f(2), cells f(4), periodic\n  k = f(f(1))\n  initial u = f(x)\n"
      "  time 0 .. 1, step 1/f(2)\n}\n";
  const Problem p = problem_of(text);
  EXPECT_EQ(p.axes[0].cells, 8);
  EXPECT_EQ(p.params[0].value, 4);
  EXPECT_EQ(p.steps, 4);
  EXPECT_EQ(print(*p.states[0].initial.formula), "2*x");
}

TEST(Operators, ReadNeighbours) {
  const std::string d = "operator slope(f) order 1 = (f[+1] - f[0])/hx\n";
  EXPECT_EQ(with(d, "k*slope(u) + 0*w*c"), "k*((u[+1] - u)/hx)");
  EXPECT_EQ(with(d, "slope(u*w) + 0*k*c"), "((u*w)[+1] - u*w)/hx");
  EXPECT_EQ(with(d, "slope(k) + u + 0*w*c"), "(k - k)/hx + u");
}

/// Each function calls the one before twice: 2^40 calls, none of which leave a trace in the result.
TEST(Functions, ThatExplodeAreStopped) {
  std::string definitions = "function f0(a) = a\n";
  for (int i = 1; i <= 40; ++i) {
    definitions += "function f" + std::to_string(i) + "(a) = 0*f" + std::to_string(i - 1) + "(a) + 0*f" +
                   std::to_string(i - 1) + "(a)\n";
  }
  EXPECT_EQ(message_at(definitions, "f40(u)"),
            "the expression is too large once its lets, operators and integrals are spelled out | call fewer functions "
            "inside one "
            "another");
}

}  // namespace
}  // namespace dpde::model
