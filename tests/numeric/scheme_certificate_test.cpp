// SPDX-License-Identifier: Apache-2.0
// Derivatives of schemes with weights, limiters and memory: tangent against adjoint on grids of 1 to 11 cells, and
// Taylor slopes, periodic and between walls, for a self-advecting wind of both signs.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "../driver/driver_support.h"
#include "stencil/text/print_stencil.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

std::string task(const std::string& advect, const std::string& time, bool periodic, int rank, const std::string& real) {
  std::string text = fmt::format(
      "model m {{ vector u; field q; param c; dt(u) = -c*advect(u, u) + 0.002*lap(u); dt(q) = -advect(u, q) }}\n"
      "scheme p {{ advect = {}; time = {}; real = {} }}\nscene s : m with p {{\n  c = 0.9\n",
      advect, time, real);
  for (int axis = 0; axis < rank; ++axis)
    text += "  " + grid(std::string(1, "xy"[axis]), axis == 0 ? 20 : 6, periodic || axis > 0);
  const std::string low = rank == 1 ? "0.2" : "(0.2, 0.1)";
  if (!periodic)
    text += "  boundary u: x.low = " + low + ", x.high = zero_gradient\n  boundary q: x.low = linear, x.high = 0.1\n";
  text += rank == 1 ? "  initial u = 0.3*sin(4*pi*x + 0.3) + 0.07\n"
                    : "  initial u = (0.3*sin(4*pi*x + 0.3) + 0.07, 0.2*cos(2*pi*y*40/6) + 0.03)\n";
  text += "  initial q = 0.5 + 0.4*cos(4*pi*x + 1)\n  time 0 .. 0.05, step 0.01\n}\n";
  return text +
         "task t : s {\n  unknown c\n  unknown initial u\n  unknown initial q\n  minimise mean(dot(u, u) + q^2)\n}\n";
}

const std::vector<std::string> advections{"upwind(5)",     "upwind(7)",       "weno(3)",  "weno(5)",
                                          "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"};

/// By day one of each kind.
bool is_of_its_kind(const std::string& advect) {
  return is_thorough() || advect == "upwind(5)" || advect == "weno(5)" || advect == "muscl(van_leer)";
}

/// The same task in f64 and in f32.
void expect_single_certified(const std::string& text, const std::string& single) {
  auto certificate = certificate_of(text, false);
  ASSERT_TRUE(certificate);
  const SourceFile source("test.dpde", single);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = options.certify = true;
  DiagnosticSink sink;
  ASSERT_TRUE(analysis::certify_single_precision(source, compiled(source, options), {}, *certificate, sink))
      << all_messages(source, sink);
  ASSERT_TRUE(certificate->single);
  EXPECT_TRUE(certificate->single->passed()) << certificate->single->worst();
}

class SchemeCertificate : public ::testing::TestWithParam<std::string> {};

TEST_P(SchemeCertificate, Passes) {
  for (const bool periodic : {true, false}) {
    const auto certificate = certificate_of(task(GetParam(), "ssp_rk3", periodic, 1, "f64"), false);
    ASSERT_TRUE(certificate);
    EXPECT_TRUE(certificate->passed());
    EXPECT_LT(certificate->worst(), 1e-12);
    EXPECT_NEAR(certificate->slope.value_or(0), 2, 0.05);
  }
}
TEST_P(SchemeCertificate, PassesInTwoDimensions) {
  if (!is_of_its_kind(GetParam())) GTEST_SKIP() << "at night";
  const auto certificate = certificate_of(task(GetParam(), "euler", false, 2, "f64"), false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed());
}
/// In f32 programs agree with their adjoints to float accuracy: no weight or limiter divides by numbers that flush to
/// 0.
TEST_P(SchemeCertificate, PassesInSinglePrecision) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  expect_single_certified(task(GetParam(), "euler", false, 1, "f64"), task(GetParam(), "euler", false, 1, "f32"));
}

/// Where all differences read by a weight or limiter are 0, on a ring with jumps and between walls.
TEST_P(SchemeCertificate, HoldsWhereTheFieldIsFlat) {
  if (!is_of_its_kind(GetParam())) GTEST_SKIP() << "at night";
  for (const bool periodic : {true, false}) {
    const auto flat = [&](const std::string& real) {
      return fmt::format(
          "model m {{ field u; param c; dt(u) = -advect(c, u) }}\nscheme p {{ advect = {}; time = ssp_rk3; real = {} "
          "}}\n"
          "scene s : m with p {{\n  c = 0.9\n  grid x = 0 .. 1, cells 64{}\n  time 0 .. 0.1, step 1/200\n}}\n"
          "task t : s {{ unknown c; unknown initial u; minimise mean((u - 0.3)^2) }}\n",
          GetParam(), real,
          periodic ? ", periodic\n  initial u = if(x > 0.2, if(x < 0.55, 1, 0), 0)"
                   : "\n  boundary u: x.low = 0.7, x.high = zero_gradient\n  initial u = 0.7");
    };
    const TaskResult expected = task_gradient(flat("f64"), "t"), single = task_gradient(flat("f32"), "t");
    const std::vector<double>&values = expected.gradient.at("u"), &singles = single.gradient.at("u");
    ASSERT_EQ(singles.size(), values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_TRUE(std::isfinite(singles[i])) << i;
      if (!periodic) EXPECT_NEAR(singles[i], values[i], 1e-6) << i;
    }
    // Next to jumps the derivative is rounding noise; but an addition to all cells stays there, whatever the weights.
    const auto sum = [](const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); };
    EXPECT_NEAR(sum(singles), sum(values), 1e-5);
    EXPECT_NEAR(single.gradient.at("c").front(), expected.gradient.at("c").front(), 1e-3);
    expect_single_certified(flat("f64"), flat("f32"));
  }
}
INSTANTIATE_TEST_SUITE_P(Numeric, SchemeCertificate, ::testing::ValuesIn(advections));

/// A wind on faces, with the last ones on walls: its values there are selected point by point around all of weno's
/// lets. The adjoint shares these; written out at each read its text had 70 kB instead of 20.
TEST(SchemeCertificateOnWalls, SharesWhatGuardsReachThrough) {
  const std::string text =
      R"(model m { field u; field s on faces.x; dt(u) = -advect(interpolate(s), u); dt(s) = -advect(s, s) - dx(u) }
scheme q { advect = weno(5); time = euler }
scene g : m with q {
  grid x = 0 .. 1, cells 20
  boundary u = zero_gradient
  boundary s: x = 0
  initial u = sin(2*pi*x)
  initial s = 0.3*cos(2*pi*x + 0.1)
  time 0 .. 0.02, step 1/200
}
task t : g { unknown initial u; unknown initial s; minimise mean(u^2 + interpolate(s)^2) }
)";
  expect_certified(text, false);
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  const auto code = compiled(source, options);
  ASSERT_TRUE(code);
  EXPECT_LT(stencil::print(code->stencil).size(), 40000u);
}

TEST(TimeSchemeCertificate, OfAb3) {
  for (const bool periodic : {true, false}) expect_certified(task("central(2)", "ab3", periodic, 1, "f64"), false);
}

}  // namespace
}  // namespace dpde::testing
