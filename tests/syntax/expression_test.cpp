// SPDX-License-Identifier: Apache-2.0
// Trees of expressions, their canonical text, and the limits of their size.
#include <gtest/gtest.h>

#include "support/match.h"
#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

/// The tree with every operation in parentheses, written by this test alone.
std::string tree(const Expr& expr) {
  return match(
      expr->kind, [](const Number& n) { return n.spelling; }, [](const Text& t) { return "'" + t.value + "'"; },
      [](const Name& n) { return n.name; },
      [](const Unary& u) { return fmt::format("({} {})", u.op == UnaryOp::negate ? "-" : "not", tree(u.operand)); },
      [](const Binary& b) { return fmt::format("({} {} {})", tree(b.left), spelling(b.op), tree(b.right)); },
      [](const Call& c) {
        std::string text = c.callee;
        for (const Argument& a : c.arguments) text += fmt::format("<{}:{}>", a.name, tree(a.value));
        return text;
      },
      [](const Tuple& t) {
        std::string text = "tuple";
        for (const Expr& e : t.elements) text += fmt::format("<{}>", tree(e));
        return text;
      },
      [](const Offsets& o) {
        std::string text = o.name;
        for (const int offset : o.offsets) text += fmt::format("@{}", offset);
        return fmt::format("{} grow {}", text, o.grow);
      },
      [](const Component& c) { return fmt::format("({} of {})", c.name.name, tree(c.operand)); },
      [](const Error&) { return std::string("error"); });
}

std::string tree_of(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const Expr expr = parse_expression(source, sink);
  return sink.all().empty() ? tree(expr) : problems(source, sink);
}

TEST(Expression, BindsByPrecedence) {
  EXPECT_EQ(tree_of("a + b*c^d"), "(a + (b * (c ^ d)))");
  EXPECT_EQ(tree_of("a - b - c"), "((a - b) - c)");
  EXPECT_EQ(tree_of("a/b*c"), "((a / b) * c)");
  EXPECT_EQ(tree_of("a^b^c"), "(a ^ (b ^ c))");
  EXPECT_EQ(tree_of("-x^2"), "(- (x ^ 2))");
  EXPECT_EQ(tree_of("-x*y"), "((- x) * y)");
  EXPECT_EQ(tree_of("2^-x^2"), "(2 ^ (- (x ^ 2)))");
  EXPECT_EQ(tree_of("a*-b"), "(a * (- b))");
  EXPECT_EQ(tree_of("--x"), "(- (- x))");
  EXPECT_EQ(tree_of("a < b + 1 and not c == d or e"), "(((a < (b + 1)) and (not (c == d))) or e)");
  EXPECT_EQ(tree_of("(a + b)*c"), "((a + b) * c)");
}

TEST(Expression, ReadsComponentsOfCallsAndGroups) {
  EXPECT_EQ(tree_of("grad(u).x"), "(x of grad<:u>)");
  EXPECT_EQ(tree_of("2*closure(u.x, v).flux^2 + 1"), "((2 * ((flux of closure<:u.x><:v>) ^ 2)) + 1)");
  EXPECT_EQ(tree_of("(u + v).y"), "(y of (u + v))");
  EXPECT_EQ(tree_of("f(a, n = g(b).z)"), "f<:a><n:(z of g<:b>)>");
  EXPECT_EQ(formatted_expression("( u+v ).y - (a, b).x*grad( w ).z"), "(u + v).y - (a, b).x*grad(w).z");
  EXPECT_EQ(tree_of("grad(u).2").substr(0, 9), "1:8 E0201");
  EXPECT_EQ(tree_of("grad(u)."),
            "1:9 E0201 expected the name of a component, as in grad(u).x but found the end of the file\n");
}

TEST(Expression, ReadsCallsTuplesAndOffsets) {
  EXPECT_EQ(tree_of("lap(u)"), "lap<:u>");
  EXPECT_EQ(tree_of("f()"), "f");
  EXPECT_EQ(tree_of("if(a < b, u, v)"), "if<:(a < b)><:u><:v>");
  EXPECT_EQ(tree_of("adam(rate = 1e-3, 2)"), "adam<rate:1e-3><:2>");
  EXPECT_EQ(tree_of("load(\"a.npy\")"), "load<:'a.npy'>");
  EXPECT_EQ(tree_of("advect((u, v), u)"), "advect<:tuple<u><v>><:u>");
  EXPECT_EQ(tree_of("u[+1, 0] - u[-1, 0]"), "(u@1@0 grow 0 - u@-1@0 grow 0)");
  EXPECT_EQ(tree_of("inside[-1] grow 1"), "inside@-1 grow 1");
  EXPECT_EQ(tree_of("f(\n  a,\n  b\n)"), "f<:a><:b>");
  EXPECT_EQ(tree_of("(a\nb)"), "1:3 E0201 expected ',' or ')' but found the end of the line\n");
}

TEST(Expression, KnowsItsRangesWithParentheses) {
  const SourceFile source("t.dpde", "(a + b)*c");
  DiagnosticSink sink;
  const Expr expr = parse_expression(source, sink);
  EXPECT_EQ(expr.range(), (SourceRange{0, 9}));
  EXPECT_EQ(std::get<Binary>(expr->kind).left.range(), (SourceRange{1, 6}));
}

TEST(Expression, PrintsTheFewestParentheses) {
  for (const char* text : {"a + b*c^d",
                           "(a + b)*c",
                           "a - (b - c)",
                           "a - b - c",
                           "a/(b*c)",
                           "a/b*c",
                           "-x^2",
                           "(-x)^2",
                           "-(a*b)",
                           "-a*b",
                           "a*(-b)",
                           "2^(-x)",
                           "(a^b)^c",
                           "a^b^c",
                           "--x",
                           "a - -b",
                           "-(a + b)",
                           "not a < b",
                           "(not a) < b",
                           "not (a and b)",
                           "a and (b or c)",
                           "a and b or c",
                           "(a < b) == c",
                           "a*(not b)",
                           "f(-x, n = 2)",
                           "(u, v)",
                           "u[+1, 0, -2]",
                           "inside[-1] grow 1",
                           "if(a < b, 1.50, 1e-3)",
                           "load(\"a b.npy\")",
                           "not not a"}) {
    EXPECT_EQ(formatted_expression(text), text);
  }
  EXPECT_EQ(formatted_expression("((a))+(b*c)"), "a + b*c");
  EXPECT_EQ(formatted_expression("a*-b"), "a*(-b)");
  EXPECT_EQ(formatted_expression("u[1,0]"), "u[+1, 0]");
  EXPECT_EQ(formatted_expression("c[1]+A[i,2]"), "c[1] + A[i, 2]");  // elements
}

TEST(Expression, PrintsWhatReadsBackAsTheSameTree) {
  const char* const operators[] = {"+", "-", "*", "/", "^", "<", "==", "and", "or"};
  int compared = 0;
  for (const char* first : operators) {
    for (const char* second : operators) {
      for (const char* form : {"(a {} b) {} c", "a {} (b {} c)", "-(a {} b) {} c", "a {} -(b {} c)",
                               "(not a {} b) {} c", "a {} (not b {} c)", "(-a {} b) {} c", "a {} (-b {} c)"}) {
        const std::string text = fmt::format(fmt::runtime(form), first, second);
        const std::string expected = tree_of(text);
        if (expected.starts_with("1:")) continue;  // comparisons of comparisons, not in parentheses
        EXPECT_EQ(tree_of(formatted_expression(text)), expected) << text;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 500);
}

TEST(Expression, SpacesInComponentsAndNorms) {
  EXPECT_EQ(formatted_expression("v . x + 1"), "v.x + 1");
  EXPECT_EQ(formatted_expression("| u - |v| |^2"), "|u - |v||^2");
}

TEST(Expression, LimitsNestingAndLength) {
  const std::string deep =
      "1:201 E0204 the expression is nested too deeply | give a part of it a name "
      "with let\n";
  EXPECT_EQ(formatted_expression(std::string(10000, '(') + "x" + std::string(10000, ')')), deep);
  EXPECT_EQ(formatted_expression(std::string(10000, '-') + "x"), deep);
  EXPECT_EQ(formatted_expression(std::string(10000, '(')), deep);
  EXPECT_EQ(formatted_expression(std::string(199, '(') + "x" + std::string(199, ')')), "x");
  std::string powers = "a", sum = "a", calls, nested = "a";
  for (int i = 0; i < 10000; ++i) powers += "^a";
  for (int i = 0; i < 100000; ++i) sum += "+a";
  for (int i = 0; i < 10000; ++i) calls += "f(";
  EXPECT_NE(formatted_expression(powers).find("E0204"), std::string::npos);
  EXPECT_NE(formatted_expression(sum).find("E0204"), std::string::npos);
  EXPECT_NE(formatted_expression(calls).find("E0204"), std::string::npos);
  // long chains within one another: the height of the tree counts
  for (int i = 0; i < 100; ++i) {
    nested = "(" + nested;
    for (int j = 0; j < 100; ++j) nested += "+a";
    nested += ")";
  }
  EXPECT_NE(formatted_expression(nested).find("E0204"), std::string::npos);
  std::string fits = "a";
  for (int i = 0; i < 1499; ++i) fits += " + a";
  EXPECT_EQ(formatted_expression(fits), fits);
}

}  // namespace
}  // namespace dpde::ast
