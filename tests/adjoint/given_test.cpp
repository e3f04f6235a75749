// SPDX-License-Identifier: Apache-2.0
// Adjoints that a person gives: they do what the derived ones do, at walls and on tiny grids, and a wrong one is
// refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "adjoint/adjoint.h"
#include "source/render.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/split_mix.h"
#include "syntax/parser.h"

namespace dpde {
namespace {

using adjoint::Activity;
using testing::parse_module;
using testing::ProgramCase;

const std::string slope = R"(
kernel slope(u: field halo 1, out s: field, hx: param) {
  s = (u[+1] - u[-1])/(2*hx)
  adjoint u_bar = (s_bar[-1] - s_bar[+1])/(2*hx)
}
kernel step(u: field halo 1, s: field, out v: field, dt, c: param) { v = u - dt*c*s*u[+1] }
)";

const std::string flux = R"(
kernel flux(u: field halo 1, w: field, out f: field, c: param) {
  f = w*u[+1, 0]^2 + c*u*u[0, -1]
  adjoint u_bar = 2*u*w[-1, 0]*f_bar[-1, 0] + c*u[0, -1]*f_bar + c*u[0, +1]*f_bar[0, +1]
  adjoint c_bar += u*u[0, -1]*f_bar
}
kernel step(u, f: field, out v: field, dt: param) on 2 axes { v = u + dt*f*u }
)";

const std::string two_results = R"(
kernel both(u: field halo 1, out a: field, inout b: field) {
  let d = u[+1] - u
  a = if(u > 1, d*d, 0)
  b += sin(u[-1])
  adjoint u_bar = if(u[-1] > 1, 2*(u - u[-1])*a_bar[-1], 0) - if(u > 1, 2*d*a_bar, 0) + b_bar[+1]*cos(u)
}
kernel begin(u: field, out b: field) { b = u^2 }
kernel end(a: field halo 2, b: field, out v: field) { v = a[-2]*b + a }
)";

/// The seed of a sum stands beside what each point adds.
const std::string energy = R"(
kernel energy(u: field halo 1, w: field, out s: field, sum e: param, c: param) {
  s = c*u[-1]*w
  e += c*w*(u[+1] - u)^2
  adjoint u_bar = 2*c*(w[-1]*(u - u[-1])*e_bar[-1] - w*(u[+1] - u)*e_bar) + c*w[+1]*s_bar[+1]
  adjoint w_bar = c*(u[+1] - u)^2*e_bar + c*u[-1]*s_bar
  adjoint c_bar += w*(u[+1] - u)^2*e_bar + u[-1]*w*s_bar
}
kernel after(s: field halo 1, out r: field) { r = s[+1] - s*s[-1] }
)";

const std::string energy_2 = R"(
kernel energy(u: field halo 1, sum e, f: param) {
  e += u[+1, 0]*u[0, -1]
  f += sin(u)
  adjoint u_bar = u[-1, -1]*e_bar[-1, 0] + u[+1, +1]*e_bar[0, +1] + cos(u)*f_bar
}
)";

const std::vector<ProgramCase>& cases() {
  static const std::vector<ProgramCase> all{
      {"periodic", 1, slope + "program p { fill u periodic; run slope; run step; swap u, v }", {{"u"}, {"c"}}},
      {"value", 1, slope + "program p { fill u x = 0.3; run slope; run step; swap u, v }", {{"u"}, {"c"}}},
      {"mixed",
       1,
       slope + "program p { fill u x.low = zero_gradient, x.high = mixed(1, 2, 0.4); run slope; run step; swap u, v }",
       {{"u"}, {"c"}}},
      {"sums",
       1,
       energy + "program p { fill u x.low = 0.3, x.high = mixed(1, 2, 0.4); run energy; keep s }",
       {{"u", "w"}, {"c"}}},
      {"sums, periodic", 1, energy + "program p { fill u periodic; run energy; keep s }", {{"u", "w"}, {"c"}}},
      {"sums, grown",
       1,
       energy + "program p { fill u x = 0.3; fill w x = zero_gradient; run energy grow 1; run after; keep r }",
       {{"u", "w"}, {"c"}}},
      {"sums, 2-D", 2, energy_2 + "program p { fill u x periodic, y = 0.1; run energy }", {{"u"}, {}}},
      {"sums, 2-D walls",
       2,
       energy_2 + "program p { fill u x.low = gradient(0.2), x.high = 1, y = zero_gradient; run energy }",
       {{"u"}, {}}},
      {"grown",
       1,
       slope + R"(
kernel twice(s: field halo 1, out r: field) { r = s[+1] - s*s[-1] }
program p { fill u x = 0.3; run slope grow 1; run twice; keep r }
)",
       {{"u"}, {}}},
      {"2-D", 2, flux + "program p { fill u x periodic, y = 0.1; run flux; run step; swap u, v }", {{"u", "w"}, {"c"}}},
      {"2-D walls",
       2,
       flux +
           "program p { fill u x.low = gradient(0.2), x.high = 1, y = zero_gradient; run flux; run step; swap u, v }",
       {{"u"}, {"c"}}},
      {"two results",
       1,
       two_results + "program p { fill u x = 0.9; run begin; run both; fill a x = zero_gradient; run end; keep v, b }",
       {{"u"}, {}}},
      {"two results, periodic",
       1,
       two_results + "program p { fill u periodic; run begin; run both; fill a periodic; run end; keep v, b }",
       {{"u"}, {}}}};
  return all;
}

std::string without_adjoints(const std::string& text) {
  return std::regex_replace(text, std::regex("\n  adjoint [^\n]*"), "");
}

std::vector<stencil::Grid> grids(int rank) {
  std::vector<stencil::Grid> result = testing::small_grids(rank);
  for (int n = 1; n <= 3; ++n) result.push_back({rank, {n, rank > 1 ? 4 - n : 1, 1}});
  return result;
}

/// Everything that a derived program leaves, from the same numbers.
std::map<std::string, std::vector<double>> results_of(const adjoint::Derivative& derivative,
                                                      const stencil::Grid& grid) {
  const stencil::Program& program = *derivative.module.find_program(derivative.program);
  int halo = 1;
  for (const auto& [field, widths] : required_halo(derivative.module, program))
    halo = std::max(halo, *std::max_element(widths.begin(), widths.end()));
  stencil::State state(grid, halo);
  const stencil::Interface interface = interface_of(derivative.module, program);
  testing::SplitMix random(17);
  stencil::Params params;
  std::set<std::string> inputs(interface.inputs.begin(), interface.inputs.end()),
      names(interface.params.begin(), interface.params.end());
  for (const std::string& field : inputs)
    state.set(field, random.uniform(static_cast<std::size_t>(grid.cells[0] * grid.cells[1]), 0.5, 1.5));
  for (const std::string& name : names) params[name] = random.uniform(0.2, 0.8);
  std::map<std::string, std::vector<double>> results;
  for (const auto& [name, sum] : interpret(derivative.module, program, state, params)) results[name] = {sum};
  for (const stencil::Swap& swap : program.swaps) results[swap.state] = state.get(swap.state);
  for (const std::string& keep : program.keeps) results[keep] = state.get(keep);
  return results;
}

void expect_same(const adjoint::Derivative& given, const adjoint::Derivative& derived, const stencil::Grid& grid) {
  const auto a = results_of(given, grid), b = results_of(derived, grid);
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, values] : a) {
    ASSERT_TRUE(b.contains(name)) << name;
    double scale = 1;
    for (const double value : b.at(name)) scale = std::max(scale, std::abs(value));
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_NEAR(values[i], b.at(name)[i], 1e-14 * scale) << name << " " << i;
  }
}

TEST(GivenAdjoint, IsTheDerivedOneOnEverySmallExtent) {
  for (const ProgramCase& c : cases()) {
    const stencil::Module module = parse_module(c.text), plain = parse_module(without_adjoints(c.text));
    DiagnosticSink sink;
    const adjoint::Derivative given = adjoint::adjoint(module, "p", c.wrt, sink),
                              derived = adjoint::adjoint(plain, "p", c.wrt, sink);
    ASSERT_FALSE(sink.has_errors()) << c.name;
    EXPECT_NE(stencil::print(given.module), stencil::print(derived.module)) << c.name << ": the formula was not taken";
    for (const stencil::Grid& grid : grids(c.rank)) {
      SCOPED_TRACE(c.name + " on " + std::to_string(grid.cells[0]) + " x " + std::to_string(grid.cells[1]));
      expect_same(given, derived, grid);
      const testing::Check check = testing::check_derivatives(module, "p", c.wrt, grid, 99 + grid.cells[0]);
      EXPECT_LT(check.dot_product, 1e-13);
      EXPECT_LT(check.finite_difference, 1e-6);
      if (HasFailure()) return;
    }
  }
}

/// The adjoint of the tangent, in which the kernel is run once more.
TEST(GivenAdjoint, LeavesSecondDerivativesAsTheyAre) {
  for (const ProgramCase& c : cases()) {
    const stencil::Module module = parse_module(c.text);
    DiagnosticSink sink;
    const adjoint::Derivative tangent = adjoint::tangent(module, "p", c.wrt, sink);
    Activity wrt = c.wrt;
    for (const std::string& field : c.wrt.fields) wrt.fields.insert(*tangent.field(field));
    for (const stencil::Grid& grid : grids(c.rank)) {
      SCOPED_TRACE(c.name);
      const testing::Check check = testing::check_derivatives(tangent.module, tangent.program, wrt, grid, 5);
      EXPECT_LT(check.dot_product, 1e-13);
      if (HasFailure()) return;
    }
  }
}

TEST(GivenAdjoint, PrintsAndReadsBack) {
  for (const ProgramCase& c : cases()) {
    const std::string text = stencil::print(parse_module(c.text));
    EXPECT_EQ(stencil::print(parse_module(text)), text);
    EXPECT_NE(text.find("  adjoint "), std::string::npos);
  }
}

TEST(GivenAdjoint, StandsInTheAdjointAsItWasWritten) {
  const stencil::Module module = parse_module(slope + "program p { fill u periodic; run slope; keep s }");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  EXPECT_EQ(stencil::print(derived.module), R"(kernel slope_adjoint(s_bar: field halo 1, out u_bar: field, hx: param) {
  u_bar = (s_bar[-1] - s_bar[+1])/(2*hx)
}

program p_adjoint {
  fill s_bar periodic
  run slope_adjoint
  keep u_bar
}
)");
}

/// What nobody asks for goes, with its seeds.
TEST(GivenAdjoint, LosesTheSeedsOfWhatIsNotComputed) {
  stencil::Module module = parse_module(two_results + "program p { fill u periodic; run begin; run both; keep b }");
  module = stencil::remove_dead_code(module);
  EXPECT_EQ(stencil::verify(module), std::vector<std::string>{});
  const std::string text = stencil::print(module);
  EXPECT_EQ(text.find("a_bar"), std::string::npos) << text;
  EXPECT_EQ(stencil::print(parse_module(text)), text);
  EXPECT_LT(testing::check_derivatives(module, "p", {{"u"}, {}}, {1, {5, 1, 1}}, 3).dot_product, 1e-13);
}

Diagnostic refusal_of(const std::string& formula, const std::string& program) {
  const std::string text = "kernel k(u, w: field halo 1, out s: field, c: param) {\n  s = c*w[+1]*u[+1] + u\n  " +
                           formula + "\n}\n" + program;
  const SourceFile source("test.dpde", text);
  const stencil::Module module = parse_module(text);
  DiagnosticSink sink;
  adjoint::adjoint(module, "p", {{"u"}, {"c"}}, sink);
  EXPECT_TRUE(sink.has_errors()) << formula;
  return sink.has_errors() ? sink.all()[0] : Diagnostic{&diagnostic_kinds[0], "", {}, "", {}};
}

TEST(GivenAdjoint, IsRefusedWhereItIsNotTheTranspose) {
  const std::string fills = "program p { fill u x = 0; fill w x = 0; run k; keep s }";
  // a sign, a factor, a term that is missing, a place that is wrong, a sum
  for (const char* formula :
       {"adjoint u_bar = s_bar - c*w*s_bar[-1]", "adjoint u_bar = s_bar + 2*c*w*s_bar[-1]", "adjoint u_bar = s_bar",
        "adjoint u_bar = s_bar + c*w[-1]*s_bar[-1]", "adjoint c_bar += w*u*s_bar"}) {
    const Diagnostic refused = refusal_of(formula, fills);
    EXPECT_EQ(refused.kind->code, "E0606") << formula;
    EXPECT_NE(refused.message.find("of k is not its transpose"), std::string::npos) << refused.message;
    EXPECT_NE(refused.hint.find("derived it is adjoint "), std::string::npos) << refused.hint;
    EXPECT_TRUE(refused.range.is_known());
  }
}

/// A sign, a factor, a term that is missing; a seed at another point, which walls tell.
TEST(GivenAdjoint, OfASumIsRefusedWhereItIsNotTheTranspose) {
  for (const char* formula :
       {"2*(u - u[-1])*e_bar[-1] + 2*(u[+1] - u)*e_bar", "(u - u[-1])*e_bar[-1] - 2*(u[+1] - u)*e_bar",
        "2*(u - u[-1])*e_bar[-1]", "0", "2*(u - u[-1])*e_bar - 2*(u[+1] - u)*e_bar"}) {
    const stencil::Module module = parse_module(
        std::string("kernel k(u: field halo 1, sum e: param) {\n  e += (u[+1] - u)^2\n  adjoint u_bar = ") + formula +
        "\n}\nprogram p { fill u x = 0.2; run k }");
    DiagnosticSink sink;
    adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
    ASSERT_TRUE(sink.has_errors()) << formula;
    EXPECT_EQ(sink.all()[0].kind->code, "E0606");
    EXPECT_EQ(sink.all()[0].hint.find("derived it is"), std::string::npos) << sink.all()[0].hint;
  }
}

/// A mistake of one part in a million, and one in a branch that few values take.
TEST(GivenAdjoint, IsRefusedForSmallMistakes) {
  for (const char* body :
       {"s = u[+1]^2\n  adjoint u_bar = 2.000001*u*s_bar[-1]", "s = if(u < -10, 2*u, u)\n  adjoint u_bar = s_bar"}) {
    const stencil::Module module = parse_module(std::string("kernel k(u: field halo 1, out s: field) {\n  ") + body +
                                                "\n}\nprogram p { fill u periodic; run k; keep s }");
    DiagnosticSink sink;
    adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
    ASSERT_TRUE(sink.has_errors()) << body;
    EXPECT_EQ(sink.all()[0].kind->code, "E0606");
  }
}

/// Told without numbers, at the formula.
TEST(GivenAdjoint, SaysWhatCanBeNoTranspose) {
  const std::pair<const char*, const char*> wrong[] = {
      {"adjoint u_bar = c*s_bar[+1]", "has a term with s_bar[+1], but the kernel does not read u[-1]"},
      {"adjoint u_bar = c*s_bar[-1] + u", "is not linear in s_bar"},
      {"adjoint u_bar = c*abs(s_bar[-1])", "is not linear in s_bar"},
      {"adjoint u_bar = c*s_bar[-1]/s_bar", "is not linear in s_bar"},
      {"adjoint w_bar = u[+2]*s_bar", "reads u[+2] in a term with s_bar"},
      {"adjoint c_bar += u*s_bar[-1]", "reads s_bar[-1]"},
      {"adjoint c_bar = u*s_bar", "is written with ="},
      {"adjoint u_bar += s_bar", "is written with +="},
      {"adjoint v_bar = s_bar", "belongs to no input"},
      {"adjoint u_bar = s_bar\n  adjoint u_bar = s_bar", "is there already"},
      {"e += u\n  adjoint u_bar = s_bar + e_bar[+1] + c*w[-1]*s_bar[-1]",
       "has a term with e_bar[+1], but the kernel does not read u[-1]"},
      {"e += u\n  adjoint u_bar = s_bar + e_bar^2", "is not linear in s_bar, e_bar"},
      {"interp(a, w) += u\n  adjoint u_bar = s_bar", "belongs to a kernel with interp(...) +="}};
  for (const auto& [formula, words] : wrong) {
    const char* more = formula[0] == 'e' ? ", sum e: param" : formula[0] == 'i' ? ", inout a: field" : "";
    const std::string parameters = std::string("u: field halo 1, w: field, out s: field, c: param") + more;
    const SourceFile source("test.dpde", "kernel k(" + parameters + ") {\n  s = c*u[+1]*w + u\n  " + formula +
                                             "\n}\nprogram p { fill u x = 0; run k; keep s }");
    DiagnosticSink sink;
    stencil::from_ast(parse(source, sink), sink);
    ASSERT_EQ(sink.all().size(), 1u) << formula;
    EXPECT_EQ(sink.all()[0].kind->code, "E0371");
    EXPECT_NE(sink.all()[0].message.find(words), std::string::npos) << sink.all()[0].message;
    EXPECT_GE(source.locate(sink.all()[0].range.begin).line, 3);
    EXPECT_FALSE(sink.all()[0].hint.empty());
  }
}

/// Where tanh is near -1, (tanh + 1)*d keeps three digits, the same for all d some roundings apart; twice less once it
/// is exact.
TEST(GivenAdjoint, IsNotRefusedWhereItsTermsCancel) {
  const stencil::Module module = parse_module(
      "kernel k(v: field, w: field halo 1, u: field, out s: field, hx: param) {\n"
      "  s = tanh((exp(cos(0.71 + v)) + w[-1])/hx)*u + u\n"
      "  adjoint u_bar = 2*(s_bar*tanh((exp(cos(0.71 + v)) + w[-1])/hx) + s_bar) - (s_bar*tanh((exp(cos(0.71 + v)) + "
      "w[-1])/hx) + s_bar)\n"
      "}\nprogram p { fill w periodic; run k; keep s }");
  DiagnosticSink sink;
  adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  EXPECT_FALSE(sink.has_errors()) << sink.all()[0].message;
}

TEST(GivenAdjoint, IsNotAskedForWhatIsPassive) {
  const stencil::Module module = parse_module(
      "kernel k(u: field halo 1, w: field, out s: field) {\n  s = u[+1]*w\n  adjoint w_bar = 3*s_bar\n}\nprogram p { "
      "fill u x = 0; run k; keep s }");
  EXPECT_LT(testing::check_derivatives(module, "p", {{"u"}, {}}, {1, {3, 1, 1}}, 3).dot_product, 1e-13);
}

}  // namespace
}  // namespace dpde
