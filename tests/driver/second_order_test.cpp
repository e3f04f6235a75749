// SPDX-License-Identifier: Apache-2.0
// Hessian and Gauss-Newton products against closed forms.
#include <cmath>
#include <numbers>

#include "driver/scene/inverse.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

/// A task ready for products; members in the order of their dependence.
struct Ready {
  SourceFile source;
  std::shared_ptr<driver::Compiled> scene;
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;

  explicit Ready(const std::string& text, driver::SessionOptions options = {}) : source("t.dpde", text) {
    driver::CompileOptions compile;
    compile.backend = driver::Backend::jit;
    compile.tangent = compile.adjoint = compile.second = true;
    scene = compiled(source, compile);
    DiagnosticSink sink;
    session = driver::Session::open(source, scene, options, sink);
    if (session) inverse = driver::Inverse::open(*session, source, sink);
    EXPECT_NE(inverse, nullptr) << all_messages(source, sink);
  }
  Eigen::VectorXd product(Curvature curvature, const Eigen::VectorXd& v) {
    EXPECT_TRUE(inverse->has_products(curvature));
    Eigen::VectorXd result(v.size());
    inverse->product(inverse->start(), v, result, curvature);
    return result;
  }
};

std::string rod(const std::string& initial, const std::string& task) {
  return R"(
model heat { field u; param k; dt(u) = k*lap(u) }
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.25
  initial u = )" +
         initial + "\n  time 0 .. 1, step 1/8\n}\ntask find : rod {\n" + task + "\n}\n";
}

const double h = 2 * std::numbers::pi / 16;
/// The factor of a step for sin(n x) is 1 - rate(n) k.
double rate(int n) { return 4.0 / 8 / (h * h) * std::pow(std::sin(n * h / 2), 2); }

/// J = 1/2 int (u(T) - d)^2: the Hessian by u0 is h times the square of the propagator, mode by mode.
TEST(SecondOrder, OfTheHeatEquationIsKnownForEachMode) {
  for (const int slots : {0, 1, 3}) {
    driver::SessionOptions options;
    options.slots = slots;
    Ready ready(rod("sin(x)", "unknown initial u; minimise 0.5*integral((u - 1)^2)"), options);
    for (int n = 0; n <= 8; ++n) {
      Eigen::VectorXd mode(16);
      for (int i = 0; i < 16; ++i) mode[i] = std::cos(n * (i + 0.5) * h) + std::sin(n * (i + 0.5) * h);
      const Eigen::VectorXd expected = h * std::pow(1 - 0.25 * rate(n), 16) * mode;
      EXPECT_LT((ready.product(Curvature::full, mode) - expected).norm(), 1e-14) << n;
      EXPECT_LT((ready.product(Curvature::gauss_newton, mode) - expected).norm(), 1e-14) << n;
    }
  }
}

/// J = f^16/2 with f = 1 - rate k; the residual is f^8 sin(x).
TEST(SecondOrder, OfAParameterIsTheClosedForm) {
  Ready ready(rod("sin(x)", "unknown k; minimise mean(u^2)"));
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  const double r = rate(1), f = 1 - 0.25 * r;
  EXPECT_NEAR(ready.product(Curvature::full, one)[0], 120 * r * r * std::pow(f, 14), 1e-13);
  EXPECT_NEAR(ready.product(Curvature::gauss_newton, one)[0], 64 * r * r * std::pow(f, 14), 1e-13);
}

/// The initial state is a formula of the unknown: J = k^4 f^16/2, residual k^2 f^8 sin(x).
TEST(SecondOrder, ReachesThroughFormulas) {
  Ready ready(rod("k^2*sin(x)", "unknown k; minimise mean(u^2)"));
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  const double k = 0.25, r = rate(1), f = 1 - k * r;
  const double full = 6 * k * k * std::pow(f, 16) - 64 * k * k * k * r * std::pow(f, 15) +
                      120 * std::pow(k, 4) * r * r * std::pow(f, 14);
  const double slope = 2 * k * std::pow(f, 8) - 8 * k * k * r * std::pow(f, 7);
  EXPECT_NEAR(ready.product(Curvature::full, one)[0], full, 1e-13);
  EXPECT_NEAR(ready.product(Curvature::gauss_newton, one)[0], slope * slope, 1e-13);
}

/// The task starts from other values; the scene's own values are those of its formula.
TEST(Inverse, KnowsTheScenesOwnValuesAndWhereTheTaskBegins) {
  Ready ready(R"(
model heated { field u; coefficient q; dt(u) = q }
scheme e { time = euler }
scene s : heated with e { grid x = 0 .. 1, cells 4, periodic
  q = 1 + x
  initial u = 2*x
  time 0 .. 0.5, step 0.1 }
task t : s { unknown q from 3; unknown initial u from 5*x
  minimise 0.5*integral(u^2) }
)");
  const std::vector<driver::Inverse::Part>& parts = ready.inverse->parts();
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(ready.inverse->own(parts[0]), (std::vector<double>{0.25, 0.75, 1.25, 1.75}));
  EXPECT_EQ(ready.inverse->own(parts[1]), (std::vector<double>{1.125, 1.375, 1.625, 1.875}));
  EXPECT_DOUBLE_EQ(ready.inverse->start()[1], 5 * 0.375);
  EXPECT_EQ(ready.inverse->start()[4], 3);
  EXPECT_EQ(ready.session->workspace().dense("q"), ready.inverse->own(parts[1])) << "the start is not the scene's";
}

/// u(T) = u0 + T q: the Hessian of 1/2 int u(T)^2 by (u0, q) is h (1, T; T, T^2) in each cell.
TEST(SecondOrder, OfACoefficientIsTheClosedForm) {
  Ready ready(R"(
model heated { field u; coefficient q; dt(u) = q }
scheme e { time = euler }
scene s : heated with e { grid x = 0 .. 1, cells 4, periodic
  q = 1 + x
  initial u = x
  time 0 .. 0.5, step 0.1 }
task t : s { unknown q; unknown initial u
  minimise 0.5*integral(u^2) + 0.25*integral(q^2) }
)");
  Eigen::VectorXd v(8);
  v << 1, 2, 3, 4, 5, 6, 7, 8;  // first u, then q
  for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
    const Eigen::VectorXd result = ready.product(curvature, v);
    for (int i = 0; i < 4; ++i) {
      const double end = v[i] + 0.5 * v[4 + i];
      EXPECT_NEAR(result[i], 0.25 * end, 1e-14);
      EXPECT_NEAR(result[4 + i], 0.25 * (0.5 * end + 0.5 * v[4 + i]), 1e-14);
    }
  }
}

TEST(SecondOrder, GaussNewtonNeedsSquares) {
  Ready ready(rod("sin(x)", "unknown k; minimise mean(u^2) + mean(exp(u))"));
  EXPECT_FALSE(ready.inverse->has_products(Curvature::gauss_newton));
  EXPECT_TRUE(ready.inverse->has_products(Curvature::full));
  Ready squares(rod("sin(x)", "unknown k; minimise 0.5*mean((u - k)^2 + 2*(u*u)/3) + 0.1*k^2, mean over time"));
  EXPECT_TRUE(squares.inverse->has_products(Curvature::gauss_newton));
}

}  // namespace
}  // namespace dpde::testing
