// SPDX-License-Identifier: Apache-2.0
// Right derivatives that certificates once refused, and an empty certificate.
#include "analysis/certificate/quick_certificate.h"
#include "driver/driver_support.h"
#include "driver/scene/inverse.h"

namespace dpde::testing {
namespace {

driver::CompileOptions for_gradient(driver::Backend backend = driver::Backend::jit) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = backend;
  options.adjoint = true;
  return options;
}

/// Errors of the quick certificate; "" if none.
std::string quick_errors(const std::string& text) {
  const SourceFile source("alarm.dpde", text);
  const auto code = compiled(source, for_gradient());
  if (!code) return "it does not compile";
  DiagnosticSink sink;
  const auto certificate = analysis::certify_quickly(source, code, analysis::Certifying::always, sink);
  return certificate ? "" : all_messages(source, sink) + text;
}

std::string moving_obstacle(const std::string& time, const std::string& cells, const std::string& radius) {
  return "model m { param U = 0.2; vector w on faces; field p; mask solid\n 0 = div(w) gives p\n"
         " w = (U, 0.1) inside solid\n dt(w) = -grad(p) + 0.1*lap(w) }\nscheme q { time = " +
         time + " }\n" + "scene s : m with q { grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 3.5, cells " + cells +
         "\n solid = (x - 0.5 - 0.1*sin(5*t))^2 + (y - 1.75)^2 < " + radius +
         "^2\n boundary w: y = 0\n initial w = (0.5, 0.2); time 0 .. 0.003, step 0.001 }\n" +
         "task t : s { unknown initial w; unknown U; minimise mean(dot(w, w)) }\n";
}

std::string implicit_flow(const std::string& cells, const std::string& solid) {
  return "model m { param beta = 0.3, a = 0.31, U = 0.2\n vector w on faces; field p, T; mask solid\n"
         " 0 = div(w) gives p\n w = (U, 0) inside solid\n dt(T) = 0.129*lap(T) - a*T^3\n"
         " dt(w) = -grad(p) + 0.158*lap(w) + (beta*0.1, 0)\n}\n"
         "scheme q { time = imex_euler; implicit = all; advect = central(2) }\nscene s : m with q { grid x = 0 .. "
         "3.5, " +
         cells + "\n solid = " + solid +
         "\n initial w = (0.5 + 0.3*sin(1.8*y), 0.2*cos(1.8*y + x)); initial T = 0.6 + 0.3*sin(1.8*y + x)\n"
         " time 0 .. 0.06, step 0.02 }\ntask t : s { unknown beta; unknown a; unknown U; unknown initial w; "
         "unknown initial T; minimise mean(dot(w, w)) + mean(T^2) + 0.1*mean(p^2) }\n";
}

/// A step without derivatives has no spacings, though dealiasing applies a transform.
TEST(FalseAlarms, DealiasingWithoutDerivatives) {
  EXPECT_EQ(quick_errors("model m { field u; param b = 0.771; dt(u) = b*mean((u - mean(u))^2) }\n"
                         "scheme q { dx = spectral; dealias = two_thirds }\nscene s : m with q {\n"
                         " grid x = 0 .. 3.5, cells 5, periodic\n initial u = 0.852 + 0.1*sin(2*pi*x/3.5)\n"
                         " time 0 .. 0.1, step 0.02 }\ntask t : s { unknown initial u; minimise mean(u^2) }\n"),
            "");
}

/// On a few cells the pressure operator reduces to rounding of cancelling differences.
TEST(FalseAlarms, ObstaclesThatMoveBetweenWalls) {
  EXPECT_EQ(quick_errors(moving_obstacle("euler", "8", "0.875")), "");
  EXPECT_EQ(quick_errors(moving_obstacle("rk4", "5", "0.525")), "");
}

/// Between obstacles, with arbitrary values, interpreter and runtime choose different solutions of a singular system.
TEST(FalseAlarms, ImplicitStepsWithMasks) {
  EXPECT_EQ(quick_errors(implicit_flow("cells 4, periodic; grid y = 0 .. 3.5, cells 4, periodic", "x < 1")), "");
  EXPECT_EQ(quick_errors(implicit_flow("cells 5, periodic; grid y = 0 .. 3.5, cells 8, periodic", "y > 1 and y < 2")),
            "");
}

/// A velocity that is fixed everywhere is 0 up to rounding of the other fields.
TEST(FalseAlarms, NewtonOfTheInterpreterWhereMasksCloseGaps) {
  const SourceFile source("gaps.dpde", implicit_flow("cells 1, periodic; grid y = 0 .. 3.5, cells 3, periodic",
                                                     "(y > 1.1667 and y < 2.3333) or (y > 2.3333 and y < 3.5000)"));
  for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    const auto code = compiled(source, for_gradient(backend));
    ASSERT_TRUE(code);
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, code, {}, sink);
    ASSERT_TRUE(session);
    const auto inverse = driver::Inverse::open(*session, source, sink);
    ASSERT_TRUE(inverse);
    EXPECT_NEAR(inverse->value(inverse->start()), 0.613414300312, 1e-10);
  }
}

/// Buckley-Leverett shock: the third derivative of the loss is so large that no remainder above rounding is of third
/// order. Differences of the gradient converge to the Hessian.
TEST(FalseAlarms, AHessianBesideAShock) {
  const auto certificate = testing::certificate_of(R"(function frac(s, a) = s^2/(s^2 + a*(1 - s)^2)
operator up(s, a) order 1 = (frac(s, a) - frac(s[-1], a))/hx
model bl { field s; param a = 0.5; dt(s) = -up(s, a) }
scheme fv { time = ssp_rk3 }
scene core : bl with fv {
  grid x = 0 .. 1, cells 100
  boundary s: x.low = 1, x.high = linear
  initial s = 0
  time 0 .. 0.4, step 1/500
}
task t : core { unknown a in 0.1 .. 3; minimise mean((s - 0.3*x)^2) at t = 0.4 }
)",
                                                   true);
  ASSERT_TRUE(certificate && certificate->second);
  EXPECT_TRUE(certificate->passed());
  EXPECT_TRUE(certificate->second->passed());
  EXPECT_FALSE(certificate->second->is_wrong());
}

/// If neither the remainder nor differences are conclusive, the gradient is still certified.
TEST(FalseAlarms, AHessianThatNothingProvesIsNoFaultOfTheGradient) {
  analysis::Certificate certificate;
  certificate.cases.push_back({"4", "1 step", 1e-15});
  certificate.slope = 2.0;
  certificate.second.emplace().cases.push_back({"4", "Hessian", 1e-15});
  certificate.second->slope = 2.1;
  EXPECT_TRUE(certificate.passed());
  EXPECT_FALSE(certificate.second->passed());
  certificate.second->quotients.emplace().is_elsewhere = true;
  EXPECT_FALSE(certificate.passed());
}

/// A network applied to a state of 0: its derivative is rounding.
TEST(FalseAlarms, NothingIsNoProof) {
  const auto certificate =
      testing::certificate_of(R"(network stress(q) { initial he, seed 1; conv 4, 3; tanh; conv out, 3, gain = 0.1 }
model m { field q; dt(q) = -q + dx(stress(q)) }
scene s : m { grid x = 0 .. 2*pi, cells 8, periodic; initial q = 0; time 0 .. 0.25, step 1/16 }
task t : s { learn stress; minimise mean((q - 1)^2) }
)",
                              false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->tests_nothing());
}

/// With --force a gradient is computed despite jumps, and its own table refuses it.
TEST(FalseAlarms, AJumpIsNotCertified) {
  const SourceFile source("jump.dpde", R"(model m { field u; param k = 1; dt(u) = -k*if(u > 0.5, 1, 0.2) }
scene s : m { initial u = 1; time 0 .. 1, step 1/1000 }
task t : s { unknown k; minimise u at t = 1 }
)");
  driver::CompileOptions options = for_gradient();
  options.tangent = options.takes_jumps = true;
  const auto code = compiled(source, options);
  ASSERT_TRUE(code);
  DiagnosticSink sink;
  const auto certificate = analysis::certify(source, code, {}, sink);
  ASSERT_TRUE(certificate);
  ASSERT_TRUE(certificate->jump);
  EXPECT_GT(certificate->jump->size, 1e-4);
  EXPECT_FALSE(certificate->passed());
}

/// A ramp narrower than all steps of the table, in addition to a loss that is linear there, of order 2, or smooth
/// everywhere. A wide ramp, or a kink, hides nothing.
TEST(FalseAlarms, ARampNarrowerThanStepsIsAJump) {
  const struct {
    const char *rate, *loss;
    bool is_jump;
  } table[] = {
      {"max(0, min(1, 1e9*(x - p)))", "mean(u)", true}, {"max(0, min(1, 1e9*(x - p)))", "mean(u) + p^2", true},
      {"tanh(1e9*(x - p))", "mean(u)", true},           {"max(0, min(1, 1e2*(x - p)))", "mean(u)", false},
      {"max(0, min(1, 10*(x - p)))", "mean(u)", false}, {"max(0, 100*(x - p))", "mean(u) + p^2", false},
  };
  for (const auto& [rate, loss, is_jump] : table) {
    const std::string text =
        std::string("model m { field u; param p = 0.5; dt(u) = p + ") + rate +
        " }\nscene s : m { grid x = 0 .. 1, cells 1000, periodic; initial u = 0; time 0 .. 0.1, step 1/100 }\n"
        "task t : s { unknown p; minimise " +
        loss + " }\n";
    const auto certificate = testing::certificate_of(text, false);
    ASSERT_TRUE(certificate) << text;
    EXPECT_EQ(certificate->jump.has_value(), is_jump) << text;
    EXPECT_EQ(certificate->passed(), !is_jump) << text;
  }
}

/// p is assumed to stay positive, and does not.
TEST(FalseAlarms, AFieldThatLosesItsSignIsNotCertified) {
  const SourceFile source("sign.dpde", R"(model m { field p, q; param k = 1.3; dt(p) = -k; dt(q) = atan(1/p) }
scene s : m { initial p = 1; initial q = 0; time 0 .. 1, step 1/2000 }
task t : s { unknown k; minimise q^2 }
)");
  driver::CompileOptions options = for_gradient();
  options.tangent = true;
  const auto code = compiled(source, options);
  ASSERT_TRUE(code);
  DiagnosticSink sink;
  const auto certificate = analysis::certify(source, code, {}, sink);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->jump);
  EXPECT_FALSE(certificate->passed());
}

}  // namespace
}  // namespace dpde::testing
