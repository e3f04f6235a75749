// SPDX-License-Identifier: Apache-2.0
// Losses that are 0 because their terms cancel: losses and gradients are rounding, which is not an error. A wrong
// gradient of another loss in the same task is still found.
#include <regex>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/quick_certificate.h"
#include "driver/driver_support.h"
#include "stencil/build.h"

namespace dpde::testing {
namespace {

/// A gas between walls that it does not cross.
constexpr const char* gas =
    "model m { field r; vector q; param c = 1.2, mu = 0.03, g = 0.3\nlet v = q/r\n"
    "dt(r) = -div(q); dt(q) = -div(outer(q, v) + c*r^1.4*identity - 2*mu*sym(grad(v))) - (0, g*r) }\n";
constexpr const char* gas_of_one_speed =
    "model m { field r; vector q; param c = 1.2, g = 0.3\n dt(r) = -div(q); dt(q) = -div(c*r*identity) }\n";
constexpr const char* gas_between_walls =
    "grid x = 0 .. 1, cells 6, periodic; grid y = 0 .. 1, cells 6\n"
    "boundary r: y = gradient(-g*0.1); boundary q.x: y = 0; boundary q.y: y = 0\n"
    "initial r = 1 + g*0.1*sin(2*pi*x); initial q = (0.2*sin(pi*y), 0.1*g*sin(pi*y))\n"
    "time 0 .. 0.4, step 1/100 }\ntask t : s { unknown c; ";
constexpr const char* reaction_model = "model m { field u; param k = 0.1, a = 0.3; dt(u) = k*lap(u) - a*u^3 }\n";
constexpr const char* odd_on_ring =
    "grid x = -1 .. 1, cells 8, periodic\ninitial u = a*sin(pi*x); time 0 .. 0.5, step 1/100 }\n"
    "task t : s { unknown k; unknown a; ";
constexpr const char* odd_between_walls =
    "grid x = -1 .. 1, cells 8\nboundary u: x = 0\ninitial u = a*sin(pi*x); time 0 .. 0.5, step 1/100 }\n"
    "task t : s { unknown k; unknown a; ";

/// On one cell differences of order 4 give rounding of rounding errors: tangent and adjoint agree on it.
constexpr const char* diffusion = "model m { field u; param k = 0.1; dt(u) = k*lap(u) }\n";
constexpr const char* decay = "model m { field u; param k = 0.1; dt(u) = k*lap(u) - k*u }\n";
constexpr const char* wave_on_ring =
    "grid x = 0 .. 1, cells 16, periodic\ninitial u = sin(2*pi*x); time 0 .. 0.02, step 1/1000 }\n"
    "task t : s { unknown k; ";

struct ZeroLoss {
  const char *equations, *scheme, *scene, *loss;
};
constexpr ZeroLoss zero_losses[] = {
    {gas, "euler", gas_between_walls, "minimise integral(q.x*r, at = y.high)"},
    {gas_of_one_speed, "rk2; dx = central(4)", gas_between_walls, "minimise integral(q.y*r, at = y.low)"},
    {gas_of_one_speed, "euler", gas_between_walls, "minimise (integral(q.x*r, at = y.high) + integral(r*dx(r)))^2"},
    {gas_of_one_speed, "ssp_rk3", gas_between_walls, "minimise integral(q.x*r, at = y.high)"},
    {gas_of_one_speed, "euler; real = f32", gas_between_walls, "minimise integral(q.x*r, at = y.high)"},
    {reaction_model, "rk2", odd_on_ring, "minimise mean(u)"},
    {reaction_model, "rk2", odd_between_walls, "minimise mean(u)"},
    {reaction_model, "rk2; real = f32", odd_on_ring, "minimise mean(u^3) + 0.5*mean(u)"},
    {reaction_model, "rk2", odd_between_walls, "minimise integral(k*u, at = x.high)"},
    {reaction_model, "rk2", odd_on_ring, "minimise sum(u*dx(u))"},
    {reaction_model, "rk2", odd_on_ring, "minimise mean(dx(u^2)), sum over time"},
};
constexpr ZeroLoss agreeing_zero_losses[] = {
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise mean(u)"},
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise mean(u)^2"},
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise mean(u)^3"},
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise abs(mean(u))"},
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise max(u) + min(u)"},
    {decay, "rk4; lap = central(4)", wave_on_ring, "minimise mean(u*cos(2*pi*x))"},
    {decay, "rk4", wave_on_ring, "minimise mean(u)"},
};
/// As small, but real.
constexpr ZeroLoss small_losses[] = {
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise 1e-20*mean(u^2)"},
    {diffusion, "rk4; lap = central(4)", wave_on_ring, "minimise 1 + 1e-20*mean(u^2)"},
    {decay, "rk4", wave_on_ring, "minimise 1e-12*k^2 + mean(u)"},
};

std::string text_of(const ZeroLoss& one, const std::string& more = "") {
  return std::string(one.equations) + "scheme p { time = " + one.scheme + " }\nscene s : m with p { " + one.scene +
         one.loss + more + " }\n";
}

std::shared_ptr<driver::Compiled> compiled_gradient(const SourceFile& source) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  return compiled(source, options);
}

TEST(ZeroLosses, AreCertifiedInPart) {
  for (const ZeroLoss& one : zero_losses) {
    const SourceFile source("zero.dpde", text_of(one));
    DiagnosticSink sink;
    const auto code = compiled_gradient(source);
    ASSERT_TRUE(code) << source.text();
    const auto found = analysis::certify_quickly(source, code, analysis::Certifying::always, sink);
    EXPECT_TRUE(found) << all_messages(source, sink) << source.text();
    if (found) EXPECT_EQ(found->run.directions, 0) << source.text();
    if (found) EXPECT_FALSE(found->left_out.empty()) << source.text();
  }
}

/// Derivatives of f32 are certified in f64, then compared in f32.
TEST(ZeroLosses, AreNothingToCertify) {
  for (const ZeroLoss& one : zero_losses) {
    const std::string text = text_of(one);
    const SourceFile source("zero.dpde", text),
        in_double("zero.dpde", std::regex_replace(text, std::regex("f32"), "f64"));
    DiagnosticSink sink;
    auto certificate = analysis::certify(in_double, compiled_gradient(in_double), {}, sink);
    ASSERT_TRUE(certificate) << all_messages(source, sink) << text;
    if (text != in_double.text()) {
      ASSERT_TRUE(analysis::certify_single_precision(source, compiled_gradient(source), {}, *certificate, sink))
          << text;
    }
    EXPECT_TRUE(certificate->tests_nothing() && certificate->passed()) << certificate->worst() << text;
  }
}

TEST(ZeroLosses, TestNothingWhereRoundingAgrees) {
  for (const ZeroLoss& one : agreeing_zero_losses) {
    const bool second = &one == agreeing_zero_losses;
    const auto found = certificate_of(text_of(one), second);
    EXPECT_TRUE(found && found->passed() && found->tests_nothing()) << text_of(one);
    if (found && second) EXPECT_TRUE(found->second && found->second->tests_nothing()) << text_of(one);
  }
}

TEST(ZeroLosses, AreNotThoseThatAreSmall) {
  for (const ZeroLoss& one : small_losses) {
    const auto found = certificate_of(text_of(one), false);
    EXPECT_TRUE(found && found->passed() && !found->tests_nothing()) << text_of(one);
  }
}

/// Sums in a step's adjoint are those of parameters.
TEST(ZeroLosses, HideNoWrongGradientOfAnotherLoss) {
  for (const std::size_t which : {3, 6}) {
    const bool is_gas = which < 5;
    const SourceFile source("zero.dpde",
                            text_of(zero_losses[which], is_gas ? "; minimise mean(r^2)" : "; minimise mean(u^2)"));
    const auto code = compiled_gradient(source);
    ASSERT_TRUE(code) << source.text();
    EXPECT_EQ(analysis::check_run(source, code, INFINITY).wrong, "") << source.text();
    for (stencil::Kernel& kernel : code->stencil.kernels) {
      if (kernel.name.find("loss") != std::string::npos) continue;
      for (stencil::Sum& sum : kernel.sums) sum.value = stencil::Expr(1.05) * sum.value;
    }
    compile_stencil_again(*code);
    EXPECT_NE(analysis::check_run(source, code, INFINITY).wrong, "") << source.text();
    DiagnosticSink sink;
    const auto certificate = analysis::certify(source, code, {}, sink);
    EXPECT_TRUE(certificate && !certificate->passed()) << source.text();
  }
}

}  // namespace
}  // namespace dpde::testing
