// SPDX-License-Identifier: Apache-2.0
// Certification must pass right derivatives and, above all, fail wrong ones.
#include "analysis/certificate/certificate.h"

#include <cmath>

#include "analysis/kinks.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "driver_support.h"
#include "stencil/build.h"

namespace dpde::testing {
namespace {

const char* wave_text = R"(model burgers {
  field u
  param nu
  dt(u) = -advect(u, u) + nu*lap(u)
}
scheme plain { advect = central(2); time = euler }
scene wave : burgers with plain {
  grid x = 0 .. 1, cells 20
  boundary u: x.low = 0.2, x.high = 0
  nu = 0.01
  initial u = sin(3*x)
  time 0 .. 0.2, step 0.02
}
)";

driver::CompileOptions for_certification() {
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.certify = options.tangent = options.adjoint = true;
  return options;
}

analysis::Certificate certificate_of_compiled(const SourceFile& source,
                                              const std::shared_ptr<driver::Compiled>& scene) {
  DiagnosticSink sink;
  const std::optional<analysis::Certificate> certificate = analysis::certify(source, scene, {}, sink);
  EXPECT_TRUE(certificate.has_value()) << all_messages(source, sink);
  return certificate.value_or(analysis::Certificate{});
}

TEST(Certificate, PassesACorrectAdjoint) {
  const SourceFile source("wave.dpde", wave_text);
  const auto scene = compiled(source, for_certification());
  ASSERT_NE(scene, nullptr);
  const analysis::Certificate certificate = certificate_of_compiled(source, scene);
  EXPECT_TRUE(certificate.passed());
  EXPECT_GE(certificate.cases.size(), 10u);
  EXPECT_TRUE(certificate.skipped.empty());
  ASSERT_TRUE(certificate.slope.has_value());
  EXPECT_NEAR(*certificate.slope, 2, 0.01);
}

TEST(Certificate, PassesVectors) {
  const SourceFile source("drift.dpde", R"(model drift {
  vector u
  field c
  coefficient vector w
  param nu
  dt(u) = -advect(u + w, u) + nu*lap(u) - grad(c)
  dt(c) = -div(c*u) + 0.1*curl(u) + 0.1*norm(u)
}
scheme plain { advect = central(2); time = rk2 }
scene pond : drift with plain {
  grid x = 0 .. 1, cells 5, periodic
  grid y = 0 .. 1, cells 4
  nu = 0.1
  w = (0.5, sin(y))
  boundary u: y.low = (1, 0), y.high = zero_gradient
  boundary c = zero_gradient
  initial u = (sin(6*x), 1 + y)
  initial c = x*y
  time 0 .. 0.02, step 0.01
}
)");
  const auto scene = compiled(source, for_certification());
  ASSERT_NE(scene, nullptr);
  const analysis::Certificate certificate = certificate_of_compiled(source, scene);
  EXPECT_TRUE(certificate.passed());
  EXPECT_EQ(certificate.cases.size(), 9u);  // the scene's grid, whole run and one step, and seven small ones
  ASSERT_TRUE(certificate.slope.has_value());
  EXPECT_NEAR(*certificate.slope, 2, 0.01);
}

TEST(Certificate, PassesOperatorsOfTheFile) {
  const SourceFile source("skew.dpde", R"(
operator skew(f, g) order 0 = f[+1, 0]*g[0, -2]/hx - f[-1, +1]*g/hy + max(f[0, +1], g[+1, 0])
model m { field u; vector v; param k; dt(u) = k*skew(u, u*u) + 0.1*lap(u); dt(v) = skew(u, v.x)*v }
scheme plain { time = rk2 }
scene pond : m with plain {
  grid x = 0 .. 1, cells 5, periodic
  grid y = 0 .. 1, cells 4
  k = 0.1
  boundary u: y.low = 1, y.high = zero_gradient
  boundary v = 0
  initial u = 2 + sin(6*x) + 0.3*y
  initial v = (x, 1 + y)
  time 0 .. 0.002, step 0.001
}
)");
  const auto scene = compiled(source, for_certification());
  ASSERT_NE(scene, nullptr);
  EXPECT_TRUE(certificate_of_compiled(source, scene).passed());
}

/// The scene recompiled after `change` was applied to every store of the step's adjoint kernels.
std::shared_ptr<driver::Compiled> with_changed_adjoint(
    const SourceFile& source, const std::function<stencil::Expr(const stencil::Expr&)>& change) {
  const auto scene = compiled(source, for_certification());
  int changed = 0;
  for (stencil::Kernel& kernel : scene->stencil.kernels) {
    if (!kernel.name.starts_with("wave_step") || kernel.name.find("adjoint") == std::string::npos) continue;
    for (stencil::Store& store : kernel.stores) {
      store.value = change(store.value);
      ++changed;
    }
  }
  EXPECT_GT(changed, 0);
  compile_stencil_again(*scene);
  return scene;
}

TEST(Certificate, FailsAnAdjointThatIsALittleWrong) {
  const SourceFile source("wave.dpde", wave_text);
  const auto scene = with_changed_adjoint(source, [](const stencil::Expr& e) { return stencil::Expr(1 + 1e-8) * e; });
  const analysis::Certificate certificate = certificate_of_compiled(source, scene);
  EXPECT_FALSE(certificate.passed());
  EXPECT_GT(certificate.worst(), 1e-9);
}

TEST(Certificate, FailsAnAdjointWithoutATerm) {
  const SourceFile source("wave.dpde", wave_text);
  const auto scene = with_changed_adjoint(source, [](const stencil::Expr& e) { return stencil::Expr(0.9) * e; });
  const analysis::Certificate certificate = certificate_of_compiled(source, scene);
  EXPECT_FALSE(certificate.passed());
  ASSERT_TRUE(certificate.slope.has_value());
  EXPECT_NEAR(*certificate.slope, 1, 0.1);  // a wrong gradient leaves a first-order remainder
}

/// The smallest step crosses hundreds of kinks: the remainder falls as the square of the step only on average, and its
/// slope varies.
TEST(Certificate, ComparesQuotientsWhereThereAreKinks) {
  const SourceFile source("relu.dpde", R"(
network n(u) { initial he, seed 3; conv 8, 3; relu; conv 8, 3; relu; conv out, 3 }
model wave { field u; dt(u) = -u*dx(u) + n(u) }
scheme plain { time = rk2; networks = f64 }
scene wave : wave with plain { grid x = 0 .. 1, cells 64, periodic; initial u = sin(2*pi*x); time 0 .. 0.1, step 0.01 }
)");
  const auto scene = compiled(source, for_certification());
  ASSERT_NE(scene, nullptr);
  const analysis::Certificate right = certificate_of_compiled(source, scene);
  EXPECT_TRUE(right.passed()) << right.slope.value_or(0);
  EXPECT_LT(right.quotients ? right.quotients->error.value_or(1) : 0, 1e-5);
  const analysis::Certificate wrong = certificate_of_compiled(
      source, with_changed_adjoint(source, [](const stencil::Expr& e) { return stencil::Expr(0.9) * e; }));
  EXPECT_FALSE(wrong.passed());
  ASSERT_TRUE(wrong.quotients);
  EXPECT_GT(wrong.quotients->error.value_or(0), 1e-4);
  EXPECT_TRUE(wrong.quotients->is_elsewhere);
}

TEST(Certificate, OfHandWrittenPrograms) {
  const SourceFile source(
      "k.dpde",
      "kernel k(u: field halo 1, a: param, out v: field, sum s: param) {\n  v = a*u[+1]*u\n  s += u^2\n}\n"
      "program p {\n  fill u x.low = 0, x.high = zero_gradient\n  run k\n  swap u, v\n}\n");
  const auto programs = compiled(source, for_certification());
  ASSERT_NE(programs, nullptr);
  const analysis::Certificate certificate = analysis::certify_programs(*programs, {});
  EXPECT_TRUE(certificate.passed()) << certificate.worst();
  EXPECT_EQ(certificate.cases.size(), analysis::small_grids(1).size());
  EXPECT_NEAR(certificate.slope.value_or(0), 2, 0.05);
}

/// On one periodic cell a difference of order 4 is 0 up to rounding, and so is the derivative by its coefficient: this
/// is reported and not called an error.
TEST(Certificate, SaysWhatIsRounding) {
  const auto certificate = testing::certificate_of(R"(model m { field u; param k; dt(u) = k*lap(u + u^2) }
scheme plain { lap = central(4); time = rk4 }
scene s : m with plain { grid x = 0 .. 1, cells 9, periodic; k = 0.1; initial u = 1.3 + sin(6*x); time 0 .. 0.01, step 0.001 }
task t : s { unknown k; minimise mean(u^3) }
)",
                                                   false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed());
  int roundings = 0;
  for (const analysis::DotCase& one : certificate->cases) {
    roundings += one.is_rounding ? 1 : 0;
    EXPECT_EQ(one.is_rounding, one.grid == "1");
    EXPECT_LT(one.is_rounding ? one.difference : one.relative_error, one.is_rounding ? one.rounding : 1e-12)
        << one.grid;
  }
  EXPECT_EQ(roundings, 1);
  EXPECT_LT(certificate->worst(), 1e-12);
  EXPECT_FALSE(certificate->is_all_rounding());
}

/// The mean of a gradient depends on the walls only, its derivative is rounding; on 7 cells the run multiplies it by
/// 1e8 in three steps.
TEST(Certificate, LeavesOutGridsOnWhichRoundingGrows) {
  const auto certificate = testing::certificate_of(R"(
operator tie(g, s) order 0 = ((abs(s - s[+1]) + s + s[+1])*(g[+1] - g) - (abs(s[-1] - s) + s[-1] + s)*(g - g[-1]))/hx
model m { vector u; vector v; field c; param a; dt(u) = 0; dt(v) = grad(c)
  dt(c) = u.x*d(d(c, x, 2), x, 2) + 0.1*tie(c, c*c*c - 0.661*c) }
scheme q { time = rk2 }
scene s : m with q {
  grid x = 0 .. 3.72, cells 2
  boundary u.x: x.low = zero_gradient, x.high = 0
  boundary v.x: x = 0
  boundary c: x = 0.974*sin(3*t + x)
  a = 0.81
  initial u.x = 0.88 + 0.31*sin(1.25*x) + 0.2*a
  initial v.x = 0.99 + 0.31*sin(1.62*x) + 0.2*a + 0.02*noise(3)
  initial c = 1.03 + 0.31*cos(x + 0.273) + 0.2*a
  time 0 .. 4*0.02, step 0.02
}
task t : s { unknown initial u.x; minimise mean(v.x)*0.566 over time }
)",
                                                   false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed()) << certificate->worst();
  ASSERT_EQ(certificate->skipped.size(), 2u);
  EXPECT_NE(certificate->skipped[0].find("7 cells: the run is not stable: v.x grows from 1.4"), std::string::npos)
      << certificate->skipped[0];
  EXPECT_EQ(certificate->skipped[1], "11 cells: the run or its loss is not finite, or a solve has no solution");
}

/// The gradient next to the start is certified; the report says that there are two slopes at the start.
TEST(Certificate, SaysThatATaskBeginsOnAKink) {
  const auto kinks = [](const std::string& start) {
    const SourceFile source("kink.dpde", R"(model m { field u; param a; dt(u) = 0*a }
scene s : m { grid x = 0 .. 1, cells 4, periodic; a = )" +
                                             start + R"(; initial u = 1; time 0 .. 1, step 0.5 }
task t : s { unknown a; unknown initial u; minimise mean(u^2) + 3*abs(a) }
)");
    driver::CompileOptions options = for_certification();
    options.selection.name = "t";
    return certificate_of_compiled(source, compiled(source, options)).kinks;
  };
  EXPECT_TRUE(kinks("0.5").empty());
  const auto found = kinks("0");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].unknown, "a");
  EXPECT_NEAR(found[0].ahead, 3, 1e-6);
  EXPECT_NEAR(found[0].behind, -3, 1e-6);
  EXPECT_EQ(found[0].gradient, 0);
}

std::shared_ptr<driver::Compiled> task_of(const SourceFile& source) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::interpreter;
  options.tangent = options.adjoint = true;
  return compiled(source, options);
}

/// Kinks count only if an unknown or a state passes them: switches by t, positions and given values do not count.
TEST(Kinks, AreWhereUnknownsMove) {
  struct Case {
    const char *rate, *loss;
    bool has_kinks;
  };
  for (const Case& c :
       {Case{"-k*u", "mean(u^2)", false}, Case{"-k*u", "mean(u^2), integral over time", false},
        Case{"-k*u*if(x < 0.5, 1, 2)", "mean(u^2)", false}, Case{"-k*u*if(t < 0.1, 1, 2)", "mean(u^2)", false},
        Case{"-k*u*abs(x - 0.3)", "mean(u^2)", false}, Case{"-k*u*max(g, 0.2)", "mean(u^2)", false},
        Case{"-k*u*max(c, 0.2)", "mean(u^2)", false}, Case{"-u*max(k, 0.2)", "mean(u^2)", true},
        Case{"-k*abs(u - 0.5)", "mean(u^2)", true}, Case{"-k*if(u > 0.5, u, 0.5)", "mean(u^2)", true},
        Case{"-k*if(max(u, c) > c*u, u, u)*if(u > c, u, c)", "mean(u^2)", true},
        Case{"-k*fraction(u)*(1 - fraction(u))", "mean(u^2)", true},
        Case{"-k*(floor(u) + fraction(u))", "mean(u^2)", true}, Case{"-k*u", "max(u)", true},
        Case{"-k*u + 0*max(c)", "mean(u^2)", false}, Case{"-k*u", "mean(abs(u - 0.5))", true}}) {
    const SourceFile source("t.dpde",
                            std::string("model m { field u; coefficient c; param k = 0.7, g = 0.1; dt(u) = ") + c.rate +
                                " }\nscene s : m {\n grid x = 0 .. 1, cells 8, periodic\n c = x\n"
                                " initial u = 0.4 + x\n time 0 .. 0.2, step 0.1\n}\n"
                                "task t : s { unknown k; unknown initial u; minimise " +
                                c.loss + " }\n");
    const auto task = task_of(source);
    ASSERT_NE(task, nullptr) << c.rate;
    EXPECT_EQ(analysis::has_kinks(*task), c.has_kinks) << c.rate << " " << c.loss;
  }
}

/// Computed by hand: the first and the last state have half weight, with one step both. Certificates of a few steps do
/// not reach the last state of the scene.
TEST(OverTime, FirstAndLastStatesCountHalf) {
  for (const int steps : {1, 2, 3}) {
    const SourceFile source("t.dpde",
                            "model m { field u; param k = 0.7; dt(u) = -k*u }\nscheme q { time = euler }\n"
                            "scene s : m with q {\n grid x = 0 .. 1, cells 4, periodic\n initial u = 1\n time 0 .. " +
                                std::to_string(steps) +
                                "/10, step 1/10\n}\n"
                                "task t : s { unknown k; minimise mean(u), integral over time }\n");
    const auto task = task_of(source);
    ASSERT_NE(task, nullptr);
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, task, {}, sink);
    const auto inverse = driver::Inverse::open(*session, source, sink);
    ASSERT_NE(inverse, nullptr) << all_messages(source, sink);
    Eigen::VectorXd gradient(1);
    const double loss = inverse->value_and_gradient(inverse->start(), gradient), factor = 1 - 0.1 * 0.7;
    double expected = 0, slope = 0;
    for (int n = 0; n <= steps; ++n) {
      const double length = n == 0 || n == steps ? 0.05 : 0.1;
      expected += length * std::pow(factor, n);
      slope += n == 0 ? 0 : -0.1 * n * length * std::pow(factor, n - 1);
    }
    EXPECT_NEAR(loss, expected, 1e-14) << steps;
    EXPECT_NEAR(gradient[0], slope, 1e-14) << steps;
  }
}

TEST(Slope, IsThatOfThePowerAndIgnoresRounding) {
  std::vector<analysis::Remainder> quadratic, linear;
  for (int k = 0; k < 16; ++k) {
    const double step = std::exp2(-k);
    quadratic.push_back({step, 3 * step * step + 1e-6});
    linear.push_back({step, 0.1 * step + step * step});
  }
  EXPECT_NEAR(analysis::remainder_slope(quadratic, 1e-4).value_or(0), 2, 1e-3);
  EXPECT_NEAR(analysis::remainder_slope(linear, 0).value_or(0), 1, 1e-3);
  EXPECT_FALSE(analysis::remainder_slope(quadratic, 10).has_value());
}

TEST(RelativeDifference, IsStrictUnlessTheTermsCancel) {
  EXPECT_DOUBLE_EQ(analysis::relative_difference(1, 1.5, 2), 0.5 / 1.5);
  EXPECT_DOUBLE_EQ(analysis::relative_difference(0, 1e-6, 1), 1e-3);
  EXPECT_EQ(analysis::relative_difference(0, 0, 0), 0);
}

}  // namespace
}  // namespace dpde::testing
