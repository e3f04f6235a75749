// SPDX-License-Identifier: Apache-2.0
// Tangent and adjoint of stencil programs, and of their own results (both are closed), on every small extent.
#include "adjoint/adjoint.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"

namespace dpde {
namespace {

using adjoint::Activity;
using testing::check_derivatives;
using testing::parse_module;
using testing::program_cases;
using testing::ProgramCase;

void expect_right(const ProgramCase& c, const stencil::Module& module, const std::string& program, const Activity& wrt,
                  bool differences) {
  double magnitude = 0;  // a departure point beyond a boundary may leave nothing to differentiate on one grid
  for (const stencil::Grid& grid : testing::small_grids(c.rank)) {
    SCOPED_TRACE(c.name + " " + program + " on " + std::to_string(grid.cells[0]) + " x " +
                 std::to_string(grid.cells[1]));
    const auto check = check_derivatives(module, program, wrt, grid, 1234 + grid.cells[0]);
    EXPECT_LT(check.dot_product, 1e-12) << stencil::print(module);
    if (differences) {
      EXPECT_LT(check.finite_difference, 1e-6);
    }
    magnitude = std::max(magnitude, check.magnitude);
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(magnitude, 0.1) << c.name;
}

TEST(Adjoint, IsTheTransposeOfTheTangentOnEverySmallExtent) {
  for (const ProgramCase& c : program_cases()) expect_right(c, parse_module(c.text), "p", c.wrt, true);
}

TEST(Adjoint, OfNetworksIsTheTransposeOfTheTangent) {
  for (const ProgramCase& c : testing::network_cases()) expect_right(c, parse_module(c.text), "p", c.wrt, true);
}

/// No wrong gradient: what is not worked out is refused.
TEST(Adjoint, NetworksHaveNoSecondDerivatives) {
  const ProgramCase c = testing::network_cases().front();
  const stencil::Module module = parse_module(c.text);
  DiagnosticSink sink;
  const adjoint::Derivative first = adjoint::adjoint(module, "p", c.wrt, sink),
                            tangent = adjoint::tangent(module, "p", c.wrt, sink);
  ASSERT_FALSE(sink.has_errors());
  for (const adjoint::Derivative* derivative : {&first, &tangent}) {
    DiagnosticSink refusal;
    adjoint::adjoint(derivative->module, derivative->program, {{"u"}, {}}, refusal);
    ASSERT_EQ(refusal.all().size(), 1u);
    EXPECT_EQ(refusal.all()[0].kind->code, "E0601");
  }
}

/// Activity of a derived program: all its inputs that can vary.
Activity inputs_of(const adjoint::Derivative& derived, const Activity& wrt) {
  Activity all = wrt;
  const stencil::Program& program = *derived.module.find_program(derived.program);
  for (const stencil::Swap& swap : program.swaps) all.fields.insert(swap.state);
  return all;
}

TEST(Adjoint, IsClosedUnderItself) {
  for (const ProgramCase& c : testing::cases_by_day(1, 2)) {
    const stencil::Module module = parse_module(c.text);
    DiagnosticSink sink;
    const adjoint::Derivative first = adjoint::adjoint(module, "p", c.wrt, sink);
    ASSERT_FALSE(sink.has_errors()) << c.name;
    if (c.name.starts_with(
            "weights that vary")) {  // a fold whose weights vary has no derivative; the tangent's adjoint has one
      adjoint::adjoint(first.module, first.program, inputs_of(first, c.wrt), sink);
      ASSERT_TRUE(sink.has_errors()) << c.name;
      EXPECT_EQ(sink.all()[0].kind->code, "E0604");
      continue;
    }
    if (c.name == "values along walls, interpolated") {
      adjoint::adjoint(first.module, first.program, inputs_of(first, c.wrt), sink);
      ASSERT_TRUE(sink.has_errors());
      EXPECT_EQ(sink.all()[0].kind->code, "E0601");
      continue;
    }
    expect_right(c, first.module, first.program, inputs_of(first, c.wrt), false);
    if (HasFailure()) return;
  }
}

TEST(Tangent, IsClosedUnderItself) {
  for (const ProgramCase& c : testing::cases_by_day(0, 2)) {
    const stencil::Module module = parse_module(c.text);
    DiagnosticSink sink;
    const adjoint::Derivative first = adjoint::tangent(module, "p", c.wrt, sink);
    ASSERT_FALSE(sink.has_errors()) << c.name;
    expect_right(c, first.module, first.program, inputs_of(first, c.wrt), false);
    if (HasFailure()) return;
  }
}

/// phi9 has phi10 in its derivative, and that phi11.
TEST(Adjoint, OfHighExponentialsIsWrittenAndReadAgain) {
  const stencil::Module module =
      parse_module("program p { axes x periodic; transform u by phi9(c*ikx^2) to v; swap u, v }");
  DiagnosticSink sink;
  const Activity wrt{{"u"}, {"c"}};
  const adjoint::Derivative first = adjoint::adjoint(module, "p", wrt, sink),
                            second = adjoint::tangent(first.module, first.program, inputs_of(first, wrt), sink);
  ASSERT_FALSE(sink.has_errors());
  for (const auto& [derivative, name] : {std::pair{&first, "phi10("}, {&second, "phi11("}}) {
    const std::string text = stencil::print(derivative->module);
    EXPECT_NE(text.find(name), std::string::npos) << text;
    EXPECT_EQ(stencil::print(parse_module(text)), text);
  }
}

/// The three closed forms of one upwind step at negative velocity: dP_i/du_i = (dt/dx)(d_i - d_{i+1}),
/// dP_i/dd_i = 1 + u_i dt/dx, dP_i/dd_{i+1} = -u_i dt/dx (gather: the last one is read at i - 1).
TEST(Adjoint, OfUpwindTransportIsTheClosedForm) {
  const stencil::Module module = parse_module(R"(
kernel step(d: field halo 1, u: field, out p: field, dt, hx: param) {
  p = d - dt*min(u, 0)*(d[+1] - d)/hx
}
program transport { fill d periodic; run step; swap d, p }
)");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "transport", {{"d", "u"}, {}}, sink);
  stencil::State state({1, {5, 1, 1}}, 2);
  const std::vector<double> d{1, 3, 2, 5, 4}, u{-1, -2, -0.5, -3, -1.5}, seed{0.3, -0.7, 1.1, 0.2, -0.9};
  const double dt = 0.1, dx = 0.25;
  state.set("d", d);
  state.set("u", u);
  state.set("p_bar", seed);
  stencil::interpret(derived.module, *derived.module.find_program(derived.program), state, {{"dt", dt}, {"hx", dx}});
  const std::vector<double> d_bar = state.get("p_bar"), u_bar = state.get("u_bar");  // swapped: p_bar holds d_bar
  for (int i = 0; i < 5; ++i) {
    const int before = (i + 4) % 5, after = (i + 1) % 5;
    EXPECT_NEAR(u_bar[i], dt / dx * (d[i] - d[after]) * seed[i], 1e-14);
    EXPECT_NEAR(d_bar[i], (1 + u[i] * dt / dx) * seed[i] - u[before] * dt / dx * seed[before], 1e-14);
  }
}

/// At a tie max follows its first argument and min its second: together they have the derivative of a + b.
TEST(Adjoint, TakesOneSideAtATie) {
  const stencil::Module module = parse_module(R"(
kernel k(a: field, b: field, out v: field, c: param) { v = max(a, b) + c*min(a, b) + abs(a - b) }
program p { run k; keep v }
)");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", {{"a", "b"}, {}}, sink);
  stencil::State state({1, {3, 1, 1}}, 1);
  state.set("a", {1, 2, 3});
  state.set("b", {2, 2, 2});
  state.set("v_bar", {1, 1, 1});
  stencil::interpret(derived.module, *derived.module.find_program(derived.program), state, {{"c", 10}});
  EXPECT_EQ(state.get("a_bar"), (std::vector<double>{10 - 1, 1, 1 + 1}));
  EXPECT_EQ(state.get("b_bar"), (std::vector<double>{1 + 1, 10, 10 - 1}));
}

/// Cells that share a maximum share its derivative; a NaN is the result.
TEST(Adjoint, SharesTheDerivativeOfAMaximumEqually) {
  const stencil::Module module = parse_module("program p { reduce m = max u over x; keep m }");
  DiagnosticSink sink;
  const adjoint::Derivative reverse = adjoint::adjoint(module, "p", {{"u"}, {}}, sink),
                            forward = adjoint::tangent(module, "p", {{"u"}, {}}, sink);
  stencil::State state({1, {4, 1, 1}}, 1);
  state.set("u", {3, 1, 3, 2});
  state.set("m_bar", {1, 10, 100, 1000});
  state.set("u_dot", {5, 70, 9, 70});
  stencil::interpret(reverse.module, *reverse.module.find_program(reverse.program), state, {});
  stencil::interpret(forward.module, *forward.module.find_program(forward.program), state, {});
  EXPECT_EQ(state.get("u_bar"), (std::vector<double>{555.5, 0, 555.5, 0}));
  EXPECT_EQ(state.get("m_dot"), (std::vector<double>{7, 7, 7, 7}));
  EXPECT_EQ(state.get("m"), (std::vector<double>{3, 3, 3, 3}));
}

TEST(Adjoint, OfAMeanIsTheMean) {
  const stencil::Module module =
      parse_module("program p { axes x periodic, y bounded; reduce m = mean u over y; keep m }");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  EXPECT_EQ(stencil::print(derived.module),
            "program p_adjoint {\n  axes x periodic, y bounded\n  reduce u_bar = mean m_bar over y\n  keep u_bar\n}\n");
}

TEST(Adjoint, OfALinearStepRecomputesNothing) {
  const stencil::Module module = parse_module(R"(
kernel step(u: field halo 1, out v: field, c: param) { v = u + c*(u[-1] - 2*u + u[+1]) }
program heat { fill u periodic; run step; swap u, v }
)");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "heat", {{"u"}, {}}, sink);
  EXPECT_EQ(stencil::print(derived.module), R"(kernel step_adjoint(v_bar: field halo 1, out u_bar: field, c: param) {
  u_bar = v_bar[-1]*c + (v_bar - v_bar*c*2) + v_bar[+1]*c
}

program heat_adjoint {
  fill v_bar periodic
  run step_adjoint
  swap v_bar, u_bar
}
)");
}

std::string code_of_error(const std::string& text, const Activity& wrt) {
  const stencil::Module module = parse_module(text);
  DiagnosticSink forward, reverse;
  adjoint::tangent(module, "p", wrt, forward);
  adjoint::adjoint(module, "p", wrt, reverse);
  EXPECT_TRUE(reverse.has_errors());
  return reverse.has_errors() ? std::string(reverse.all()[0].kind->code) : "";
}

/// As sign has it: what jumps is refused where a task is known (driver/compile/switches.h). x - floor(x) is
/// fraction(x).
TEST(Adjoint, FloorHasTheDerivativeZero) {
  const auto text_of = [](const std::string& value) {
    const stencil::Module module =
        parse_module("kernel k(u: field, out v: field) { v = " + value + " }\nprogram p { run k; keep v }");
    DiagnosticSink sink;
    const adjoint::Derivative derivative = adjoint::tangent(module, "p", {{"u"}, {}}, sink);
    EXPECT_FALSE(sink.has_errors()) << value;
    const std::string text = print(derivative.module);
    return text.substr(text.find("kernel k_tangent"));
  };
  EXPECT_EQ(text_of("u - floor(u)"), text_of("fraction(u)"));
  EXPECT_EQ(text_of("u + floor(u)"), text_of("u"));
}

TEST(Adjoint, RefusesWhatItCannotDifferentiate) {
  EXPECT_EQ(code_of_error(R"(
kernel a(u: field, out w: field) { w = u^2 }
kernel b(u: field, inout w: field) { w += w*u }
program p { run a; run b; keep w }
)",
                          {{"u"}, {}}),
            "E0602");
  EXPECT_EQ(code_of_error(R"(
kernel a(u: field, out w: field) { w = u^2 }
kernel b(w: field, out v: field) { v = w^2 }
kernel c(u: field, inout w: field) { w += u }
program p { run a; run b; run c; keep v, w }
)",
                          {{"u"}, {}}),
            "E0603");
  EXPECT_EQ(code_of_error(R"(
kernel a(u: field, out w: field) { w = u^2 }
kernel c(u: field, inout w: field) { w += u }
program p { run a; reduce m = max w; run c; keep m, w }
)",
                          {{"u"}, {}}),
            "E0603");
  EXPECT_EQ(code_of_error(R"(
kernel begin(u: field, out w: field) { w = 0.3*u^2 }
kernel square(w: field halo 1, out v: field) { v = 0.5*w[-1]*w + 0.2*w[+1]^2 }
kernel add(u: field, inout w: field) { w += u^3 }
kernel end(w: field, w2: field, out n: field) { n = 0.1*w^2 + w2 }
program p { run begin; repeat 2 { fill w periodic; run square; swap w, v } to w2; run add; run end; swap u, n }
)",
                          {{"u"}, {}}),
            "E0603")
      << "a state that a repeat began from";
  EXPECT_EQ(code_of_error(R"(
kernel k(u: field halo 1, out v: field) { v = u[+1]*u }
program p { fill u x = nu; run k; keep v }
)",
                          {{"u"}, {"nu"}}),
            "E0604");
}

}  // namespace
}  // namespace dpde
