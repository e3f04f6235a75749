// SPDX-License-Identifier: Apache-2.0
// Fluxes between two states with the larger of two speeds, with walls, where the states are mirror images and the
// speeds are equal. Gradients against central differences of runs, for each back end, and symmetry of the Hessian.
#include <cmath>

#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "driver_support.h"
#include "stencil/text/print_stencil.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using driver::Backend;

/// Gas in a tube between walls, with Rusanov's flux. The last bit of the speed depends on how its formula is evaluated.
std::string tube(const std::string& time, const std::string& choice, const std::string& unknown) {
  return R"(operator rusanov(f, q, s) order 0 = (0.5*(f[+1] - f[-1]) - 0.5*()" + choice +
         R"((s, s[+1])*(q[+1] - q) - )" + choice + R"((s[-1], s)*(q - q[-1])))/hx
function larger(a, b) = if(a > b, a, b)
function upper(a, b) = 0.5*(a + b + abs(a - b))
scheme plain { time = )" +
         time + R"( }
model euler {
  field r, m, e
  param g
  let p = (g - 1)*(e - 0.5*m^2/r)
  let s = abs(m/r) + sqrt(g*p/r)
  dt(r) = -rusanov(m, r, s)
  dt(m) = -rusanov(m^2/r + p, m, s)
  dt(e) = -rusanov(m/r*(e + p), e, s)
}
scene tube : euler with plain {
  grid x = 0 .. 1, cells 16
  g = 1.4
  boundary r = zero_gradient
  boundary e = zero_gradient
  boundary m = 0
  initial r = 1 + 0.3*exp(-20*(x - 0.3)^2)
  initial e = 2.5 + exp(-30*(x - 0.4)^2)
  initial m = 0.2*sin(5*x)
  time 0 .. 0.2, step 0.01
}
task t : tube { unknown )" +
         unknown + R"(; minimise integral(r^2 + m*e) at t = 0.2 }
)";
}

/// A task ready for evaluations.
struct TiedScene {
  SourceFile source;
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;

  TiedScene(const std::string& text, Backend backend) : source("t.dpde", text) {
    driver::CompileOptions options;
    options.selection.name = "t";
    options.backend = backend;
    options.adjoint = true;
    const auto code = compiled(source, options);
    DiagnosticSink sink;
    if (code) session = driver::Session::open(source, code, {}, sink);
    if (session) inverse = driver::Inverse::open(*session, source, sink);
    EXPECT_NE(inverse, nullptr) << all_messages(source, sink);
  }
  double loss_at(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient.resize(x.size());
    return inverse->value_and_gradient(x, gradient);
  }
};

void expect_right(const std::string& text, Backend backend) {
  TiedScene ready(text, backend), oracle(text, Backend::interpreter);
  ASSERT_TRUE(ready.inverse && oracle.inverse);
  const Eigen::VectorXd start = ready.inverse->start();
  Eigen::VectorXd direction(start.size()), gradient, other, unused;
  for (Eigen::Index i = 0; i < direction.size(); ++i) direction[i] = 1 + 0.5 * std::sin(3.0 * static_cast<double>(i));
  constexpr double h = 1e-5;
  ready.loss_at(start, gradient);
  oracle.loss_at(start, other);
  const double slope = gradient.dot(direction);
  const double quotient =
      (ready.loss_at(start + h * direction, unused) - ready.loss_at(start - h * direction, unused)) / (2 * h);
  EXPECT_GT(std::abs(slope), 1e-3);
  EXPECT_NEAR(slope, quotient, 1e-7 * std::abs(slope));
  EXPECT_LT((gradient - other).norm(), 1e-12 * other.norm());
}

TEST(Ties, GradientsBetweenWallsAreThoseOfRuns) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const char* const cases[][3] = {
      {"euler", "max", "g"},           {"euler", "max", "initial r"}, {"euler", "larger", "initial m"},
      {"euler", "upper", "initial r"}, {"rk4", "max", "initial r"},   {"rk4", "larger", "initial r"}};
  for (const auto& [time, choice, unknown] : cases) {
    SCOPED_TRACE(std::string(time) + ", " + choice + ", " + unknown);
    expect_right(tube(time, choice, unknown), Backend::jit);
  }
}

/// Values equal up to rounding, as mirror images that a back end sums in another order, share the derivative of the
/// extreme value. Values that a difference of losses can distinguish do not.
TEST(Ties, CellsThatDifferByRoundingShareAnExtreme) {
  for (const auto& [extreme, apart, share] :
       {std::tuple{"max", "1e-13", 0.5}, std::tuple{"max", "-1e-13", 0.5}, std::tuple{"min", "1e-13", 0.5},
        std::tuple{"max", "1e-8", 0.0}, std::tuple{"max", "-1e-8", 1.0}, std::tuple{"min", "1e-8", 1.0}}) {
    const std::string sign = extreme == std::string("min") ? "-" : "";
    const std::string text = "model m { field u; dt(u) = 0*u }\nscene s : m {\n  grid x = 0 .. 4, cells 4, periodic\n" +
                             ("  initial u = if(x < 1, " + sign + "3, if(x > 3, " + sign + "3 + " + apart + ", 0))\n") +
                             "  time 0 .. 1, step 1\n}\ntask t : s { unknown initial u; minimise " + extreme +
                             "(u) at t = 1 }\n";
    for (const Backend backend : {Backend::jit, Backend::interpreter}) {
      TiedScene scene(text, backend);
      ASSERT_NE(scene.inverse, nullptr);
      Eigen::VectorXd gradient;
      scene.loss_at(scene.inverse->start(), gradient);
      EXPECT_EQ(gradient, (Eigen::Vector4d{share, 0, 0, 1 - share})) << extreme << " " << apart;
    }
  }
}

/// States that repeat along the axis, whose Fourier series are rounded differently in each back end.
TEST(Ties, MirrorImagesGiveEachBackEndTheSameGradient) {
  const std::string text = R"(model m { field u; coefficient k; dt(u) = 0.4*div(k*grad(u)) }
scheme q { time = etdrk2; advect = spectral; dx = spectral; lap = spectral }
scene s : m with q {
  grid x = 0 .. 4.17, cells 6, periodic
  grid y = 0 .. 4.93, cells 6, periodic
  k = 0.4
  initial u = 0.6 + 0.3*(sin(2*2*pi*x/4.17 + 1.281) + sin(2*2*pi*y/4.93 + 2.065))
  time 0 .. 0.08, step 0.02
}
task t : s { unknown initial u; minimise max(u), integral over time }
)";
  TiedScene one(text, Backend::jit), other(text, Backend::interpreter);
  ASSERT_TRUE(one.inverse && other.inverse);
  Eigen::VectorXd gradient, wanted;
  one.loss_at(one.inverse->start(), gradient);
  other.loss_at(other.inverse->start(), wanted);
  EXPECT_LT((gradient - wanted).norm(), 1e-10 * wanted.norm());
}

/// s, which is compared between all neighbours and also multiplied by a factor.
std::string wide(const std::string& factor) {
  std::string sum;
  for (const std::string offset : {"+1", "-1", "+2", "-2", "+3", "-3"}) {
    sum += " + if(s > s[" + offset + "], 0.1*f*q[" + offset + "], 0)";
  }
  return "operator wide(q, s, f) order 0 = 0" + sum + R"(
model m {
  field u
  coefficient c
  let s = sqrt(c/(1 + c^2)) + exp(-1.3*c)*c + c^3/(3 + c)
  dt(u) = wide(u, s, )" +
         factor + R"() - u
}
scheme plain { time = euler }
scene w : m with plain {
  grid x = 0 .. 1, cells 8
  boundary u = zero_gradient
  c = 1 + 0.3*sin(6*x)
  initial u = 1 + 0.2*cos(5*x)
  time 0 .. 0.5, step 0.1
}
task t : w { unknown initial u; minimise integral(u^3) at t = 0.5 }
)";
}

/// The compared value is worth storing for all displacements: stored and unstored values are rounded differently.
TEST(Ties, WhatIsComparedIsNotStoredForOneSideAlone) {
  for (const Backend backend : {Backend::jit, Backend::cpp}) {
    SCOPED_TRACE(backend == Backend::jit ? "jit" : "cpp");
    for (const std::string cells : {"5", "8", "16"}) {
      SCOPED_TRACE(cells);
      std::string text = wide("2");
      expect_right(text.replace(text.find("cells 8"), 7, "cells " + cells), backend);
    }
  }
}

/// The factor is stored together with s; in comparisons s stays as written.
TEST(Ties, WhatIsComparedStaysAsItIsBesideWhatIsStored) {
  const std::string text = wide("exp(-c)*sin(c)*cos(2*c)*tanh(c)*log(c + 2)*sin(3*c)*exp(c^2)*cosh(c)*s");
  const SourceFile source("t.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  const auto scene = compiled(source, options);
  EXPECT_NE(stencil::print(scene->stencil).find("shared_bar[+1]"), std::string::npos);
  EXPECT_EQ(stencil::print(scene->stencil).find("> shared_bar"), std::string::npos);
  for (const Backend backend : {Backend::jit, Backend::cpp}) expect_right(text, backend);
}

TEST(Ties, EmittedCppChoosesAsTheInterpreter) { expect_right(tube("euler", "max", "initial r"), Backend::cpp); }

TEST(Ties, HessiansBetweenWallsAreSymmetric) {
  const auto certificate = certificate_of(
      R"(operator along_x(q, s) order 0 = (max(s, s[+1, 0])*(q[+1, 0] - q) - max(s[-1, 0], s)*(q - q[-1, 0]))/hx
operator along_y(q, s) order 0 = (max(s, s[0, +1])*(q[0, +1] - q) - max(s[0, -1], s)*(q - q[0, -1]))/hy
scheme plain { time = rk2; dx = central(2) }
model water {
  field h, m, n
  param g
  let c = sqrt(g*h)
  dt(h) = -dx(m) - dy(n) + 0.5*along_x(h, abs(m/h) + c) + 0.5*along_y(h, abs(n/h) + c)
  dt(m) = -dx(m^2/h + 0.5*g*h^2) - dy(m*n/h) + 0.5*along_x(m, abs(m/h) + c) + 0.5*along_y(m, abs(n/h) + c)
  dt(n) = -dx(m*n/h) - dy(n^2/h + 0.5*g*h^2) + 0.5*along_x(n, abs(m/h) + c) + 0.5*along_y(n, abs(n/h) + c)
}
scene basin : water with plain {
  grid x = 0 .. 1, cells 9
  grid y = 0 .. 1, cells 7
  g = 1
  boundary h = zero_gradient
  boundary m: x = 0, y = zero_gradient
  boundary n: x = zero_gradient, y = 0
  initial h = 1 + 0.3*exp(-20*((x - 0.3)^2 + y^2))
  initial m = 0.2*sin(5*x)
  initial n = 0.1*cos(4*y)
  time 0 .. 0.1, step 0.01
}
task t : basin { unknown initial h; minimise integral(h^3 + m*n + m^2) at t = 0.1 }
)",
      true);
  ASSERT_TRUE(certificate);
  EXPECT_LT(certificate->worst(), 1e-13);
  ASSERT_TRUE(certificate->second);
  EXPECT_LT(certificate->second->worst(), 1e-12);
}

}  // namespace
}  // namespace dpde::testing
