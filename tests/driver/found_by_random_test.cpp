// SPDX-License-Identifier: Apache-2.0
// Errors found by random models (tests/random), each with its smallest text.
#include <cmath>

#include "analysis/certificate/certificate.h"
#include "driver_support.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/scene_run.h"
#include "syntax/parser.h"

namespace dpde::testing {
namespace {

driver::CompileOptions for_task() {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = true;
  return options;
}

/// Kernels were named after components, s_step_u.y_wall, which cannot be parsed.
TEST(FoundByRandomModels, KernelsOfComponentsReadBack) {
  const std::string walls = R"(model m { vector u on nodes; control F; dt(u) = 0.1*lap(u)*max(u.x) }
scheme q { time = euler }
scene s : m with q {
  grid x = 0 .. 1.79, cells 2
  grid y = 0 .. 3.02, cells 1, periodic
  boundary u.x: x = 0
  boundary u.y: x.low = 0, x.high = F
  F = 0.3*cos(5*t) every 0.02
  initial u = (1, y)
  time 0 .. 0.08, step 0.02
  subcycle u in 2
}
task t : s { unknown initial u.y; minimise mean(u.y^2) }
)";
  const SourceFile source("walls.dpde", walls);
  const auto code = compiled(source, for_task());
  ASSERT_NE(code, nullptr);
  const std::string text = stencil::print(code->stencil);
  DiagnosticSink sink;
  const std::string again = stencil::print(stencil::from_ast(parse(SourceFile("again.dpde", text), sink), sink));
  EXPECT_FALSE(sink.has_errors());
  EXPECT_EQ(again, text);
  EXPECT_NE(text.find("u_y_wall("), std::string::npos) << text;
}

/// Optimisation passes remove y, as sin(y) - sin(y) cancels; the interpreter, which runs without them, reads it.
TEST(FoundByRandomModels, TheInterpreterReadsWhatCancels) {
  const std::string text = R"(model m { field u; dt(u) = dx(sin(y) + u) }
scheme q { time = euler }
scene s : m with q {
  grid x = 0 .. 2.5, cells 3, periodic
  grid y = 0 .. 3, cells 4, periodic
  initial u = cos(y)*x
  time 0 .. 0.02, step 0.02
}
)";
  const auto wanted = run_scene(text, "s").state.at("u"),
             got = run_scene(text, "s", {}, driver::Backend::interpreter).state.at("u");
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], wanted[i], 1e-14);
}

/// Exponential steps without linear terms lost all but the first value of a line: nothing is transformed there.
TEST(FoundByRandomModels, ExponentialStepsWithoutLinearTerms) {
  for (const std::string time : {"etdrk2", "etdrk4"}) {
    for (const std::string rate : {"-u^2", "div((1 + u)*grad(u))", "0.4*div(k*grad(u))"}) {
      for (const std::string more : {"", "  grid y = 0 .. 2, cells 3, periodic\n"}) {
        const std::string text = "model m { field u; coefficient k; dt(u) = " + rate + " }\nscheme q { time = " + time +
                                 " }\nscene s : m with q {\n  grid x = 0 .. 4, cells 6, periodic\n" + more +
                                 "  k = 0.4\n  initial u = 0.6 + 0.3*sin(pi*x/2)\n  time 0 .. 0.04, step 0.02\n}\n";
        const auto wanted = run_scene(text, "s", {}, driver::Backend::interpreter).state.at("u"),
                   got = run_scene(text, "s").state.at("u");
        ASSERT_EQ(got.size(), wanted.size());
        for (std::size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], wanted[i], 1e-14) << time << " " << rate;
      }
    }
  }
}

/// This was an error of the rollout, without a position.
TEST(FoundByRandomModels, ALossOfNothingThatVariesIsRefusedInItsPlace) {
  const SourceFile source("loss.dpde", R"(model m { field u; param a; dt(u) = a*lap(u) }
scene s : m {
  grid x = 0 .. 2.5, cells 3, periodic
  a = 2
  initial u = x
  time 0 .. 0.02, step 0.02
}
task t : s { unknown initial u; minimise mean(u^2); minimise 0.1*mean(a^2) }
)");
  DiagnosticSink sink;
  EXPECT_FALSE(driver::compile(source, for_task(), sink));
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].kind->code, "E0601");
  EXPECT_EQ(source.text().substr(static_cast<std::size_t>(sink.all()[0].range.begin), 13), "minimise 0.1*");
}

/// On one cell dx(u) is 0: tangent and adjoint are independent rounding errors.
TEST(FoundByRandomModels, ADerivativeOfNothingButRoundingIsCertified) {
  const SourceFile source("rounding.dpde", R"(model m { field u, v; dt(u) = 0; dt(v) = 0 }
scheme q { time = euler }
scene s : m with q {
  grid x = 0 .. 1.31, cells 4, periodic, stretched x + 0.1*sin(2*pi*x/1.31)
  initial u = sin(4.8*x)
  initial v = 1 + x
  time 0 .. 0.02, step 0.02
}
task t : s { unknown initial u; minimise sum(v*dx(u)) }
)");
  const auto code = compiled(source, for_task());
  ASSERT_NE(code, nullptr);
  DiagnosticSink sink;
  const auto certificate = analysis::certify(source, code, {}, sink);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed()) << certificate->worst();
}

}  // namespace
}  // namespace dpde::testing
