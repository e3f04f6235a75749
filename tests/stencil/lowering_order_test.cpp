// SPDX-License-Identifier: Apache-2.0
// Measured orders of what the lowering makes, against closed forms, by the reference interpreter.
#include <gtest/gtest.h>

#include <numbers>

#include "stencil/model_builder.h"
#include "stencil/scene_run.h"

namespace lowering_order {
namespace {

using namespace model_builder;
using scene_run::Scene;

constexpr double pi = std::numbers::pi;
const Expr u = field("u"), kappa = field("kappa"), t = param("t");
using Function = std::function<double(double)>;

/// Error of the right-hand side `rate` at u = sin(x) on [0, 2 pi]: one Euler step of size 1, less u.
double rate_error(const Expr& rate, const model::Scheme& scheme, int cells, const Function& exact,
                  const Function& coefficient = nullptr) {
  model::Problem p = problem({state("u", rate)}, {cells}, 2 * pi);
  p.scheme = scheme;
  p.scheme.time = model::time_method("euler");
  p.step = 1;
  if (coefficient) p.coefficients = {{"kappa", {}}};
  Scene scene(p);
  scene.set("u", [](double x) { return std::sin(x); });
  if (coefficient) scene.set("kappa", coefficient);
  scene.step(1);
  return scene.error("u", [&](double x) { return std::sin(x) + exact(x); });
}

double rate_order(const Expr& rate, const model::Scheme& scheme, int cells, const Function& exact,
                  const Function& coefficient = nullptr) {
  return scene_run::order([&](int n) { return rate_error(rate, scheme, n, exact, coefficient); }, cells);
}

model::Scheme central(int order) {
  model::Scheme scheme;
  scheme.derivative_order = scheme.laplacian_order = scheme.transport.order = order;
  return scheme;
}

TEST(LoweringOrder, CentralFirstDerivatives) {
  const Function cosine = [](double x) { return std::cos(x); };
  EXPECT_NEAR(rate_order(d(u), central(2), 32, cosine), 2, 0.05);
  EXPECT_NEAR(rate_order(d(u), central(4), 32, cosine), 4, 0.05);
  EXPECT_LT(rate_error(d(u), central(2), 64, cosine), 1.7e-3);  // h^2/6
  EXPECT_LT(rate_error(d(u), central(4), 64, cosine), 3.2e-6);  // h^4/30
}

TEST(LoweringOrder, CentralSecondDerivatives) {
  const Function exact = [](double x) { return -std::sin(x); };
  EXPECT_NEAR(rate_order(lap(u), central(2), 32, exact), 2, 0.05);
  EXPECT_NEAR(rate_order(lap(u), central(4), 32, exact), 4, 0.05);
  EXPECT_LT(rate_error(lap(u), central(2), 64, exact), 8.1e-4);  // h^2/12
  EXPECT_LT(rate_error(lap(u), central(4), 64, exact), 1.1e-6);  // h^4/90
}

TEST(LoweringOrder, HigherAndNestedDerivatives) {
  const Function minus_cosine = [](double x) { return -std::cos(x); };
  const Function sine = [](double x) { return std::sin(x); };
  for (const int order : {2, 4}) {
    EXPECT_NEAR(rate_order(d(u, 0, 3), central(order), 24, minus_cosine), order, 0.1);
    EXPECT_NEAR(rate_order(d(d(u, 0, 2)), central(order), 24, minus_cosine), order, 0.1);
    EXPECT_NEAR(rate_order(d(d(d(u))), central(order), 24, minus_cosine), order, 0.1);
    EXPECT_NEAR(rate_order(lap(lap(u)), central(order), 24, sine), order, 0.1);
    EXPECT_NEAR(rate_order(d(d(d(d(u)))), central(order), 24, sine), order, 0.1);
    EXPECT_NEAR(rate_order(d(u, 0, 4), central(order), 24, sine), order, 0.1);
  }
}

TEST(LoweringOrder, Advection) {
  const Function exact = [](double x) { return std::sin(x) * std::cos(x); };
  EXPECT_NEAR(rate_order(advect({u}, u), central(2), 32, exact), 2, 0.1);
  EXPECT_NEAR(rate_order(advect({u}, u), central(4), 32, exact), 4, 0.1);
  model::Scheme upwind;
  upwind.transport.advect = model::Advection::upwind;
  upwind.transport.order = 1;
  EXPECT_NEAR(rate_order(advect({u}, u), upwind, 32, exact), 1, 0.1);
  EXPECT_NEAR(rate_order(advect({-1.0}, u), upwind, 32, [](double x) { return -std::cos(x); }), 1, 0.1);
  model::Scheme third = upwind;
  third.transport.order = 3;
  third.derivative_order = 4;
  EXPECT_NEAR(rate_order(advect({u}, u), third, 32, exact), 3, 0.1);
  EXPECT_NEAR(rate_order(advect({-1.0}, u), third, 32, [](double x) { return -std::cos(x); }), 3, 0.1);
  EXPECT_NEAR(rate_order(advect({1.0}, d(u)), third, 32, [](double x) { return -std::sin(x); }), 3, 0.15);
  // of a derivative, where neighbours of u_x are differences too; and differentiated, where it sits between cells
  EXPECT_NEAR(rate_order(advect({1.0}, d(u)), upwind, 32, [](double x) { return -std::sin(x); }), 1, 0.1);
  const Function slope = [](double x) { return std::cos(2 * x); };
  EXPECT_NEAR(rate_order(d(advect({u}, u)), central(2), 32, slope), 2, 0.1);
  EXPECT_NEAR(rate_order(d(advect({u}, u)), central(4), 32, slope), 4, 0.1);
  EXPECT_NEAR(
      rate_order(d(advect({2.0 + u}, u)), upwind, 128, [](double x) { return std::cos(2 * x) - 2 * std::sin(x); }), 1,
      0.1);
}

TEST(LoweringOrder, FluxFormWithVariableCoefficient) {
  const Function coefficient = [](double x) { return 2 + std::cos(x); };
  // ((2 + cos x) cos x)' = -2 sin x - sin 2x
  const Function exact = [](double x) { return -2 * std::sin(x) - std::sin(2 * x); };
  for (const int order : {2, 4}) {
    EXPECT_NEAR(rate_order(d(kappa * d(u)), central(order), 32, exact, coefficient), order, 0.1);
    const Expr formula = 2.0 + call(Fn::cos, coordinate(0));
    EXPECT_NEAR(rate_order(d(formula * d(u)), central(order), 32, exact), order, 0.1);
  }
}

TEST(LoweringOrder, NonlinearFluxes) {
  // ((1 + u^2) u_x)_x with u = sin x: 2 u u_x^2 - (1 + u^2) u
  const Function exact = [](double x) {
    const double s = std::sin(x), c = std::cos(x);
    return 2 * s * c * c - (1 + s * s) * s;
  };
  // ((2 + u_x^2) u_x)_x = (2 + 3 u_x^2) u_xx
  const Function gradient = [](double x) { return -(2 + 3 * std::cos(x) * std::cos(x)) * std::sin(x); };
  for (const int order : {2, 4}) {
    EXPECT_NEAR(rate_order(d((1.0 + (u ^ 2.0)) * d(u)), central(order), 32, exact), order, 0.1);
    EXPECT_NEAR(rate_order(d((2.0 + (d(u) ^ 2.0)) * d(u)), central(order), 32, gradient), order, 0.1);
    // a second derivative inside a flux is interpolated: (u u_xx)_x = -2 sin x cos x
    EXPECT_NEAR(rate_order(d(u * d(u, 0, 2) + d(u)), central(order), 32,
                           [](double x) { return -std::sin(2 * x) - std::sin(x); }),
                order, 0.1);
  }
}

TEST(LoweringOrder, MixedDerivativesInTwoDimensions) {
  // (kappa (u_x + u_y))_x with kappa = 2 + sin(x + y), u = sin(x) cos(2 y)
  const auto error = [](int order, int cells) {
    model::Problem p = problem({state("u", d(kappa * (d(u, 0) + d(u, 1)), 0))}, {cells, cells}, 2 * pi);
    p.scheme = central(order);
    p.scheme.time = model::time_method("euler");
    p.step = 1;
    p.coefficients = {{"kappa", {}}};
    Scene scene(p);
    std::vector<double> start, coefficient, end;
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        const double x = scene.x(i), y = scene.x(j);
        const double k = 2 + std::sin(x + y), k_x = std::cos(x + y);
        const double slopes = std::cos(x) * std::cos(2 * y) - 2 * std::sin(x) * std::sin(2 * y);
        const double slopes_x = -std::sin(x) * std::cos(2 * y) - 2 * std::cos(x) * std::sin(2 * y);
        start.push_back(std::sin(x) * std::cos(2 * y));
        coefficient.push_back(k);
        end.push_back(start.back() + k_x * slopes + k * slopes_x);
      }
    }
    scene.set("u", start);
    scene.set("kappa", coefficient);
    scene.step(1);
    double worst = 0;
    const std::vector<double> result = scene.get("u");
    for (std::size_t i = 0; i < end.size(); ++i) worst = std::max(worst, std::abs(result[i] - end[i]));
    return worst;
  };
  for (const int order : {2, 4}) {
    EXPECT_NEAR(scene_run::order([&](int n) { return error(order, n); }, 24), order, 0.15);
  }
}

/// Error at t = 1 of u' = -(1 + 2 t) u together with the oscillator p' = q, q' = -p; one cell, no space.
double time_error(model::TimeScheme scheme, int steps) {
  const Expr rate = -((1.0 + 2.0 * t) * u);
  model::Problem p = problem({state("u", rate), state("p", field("q")), state("q", -field("p"))}, {1});
  p.scheme.time = scheme;
  p.step = 1.0 / steps;
  Scene scene(p);
  scene.set("u", std::vector<double>{1.0});
  scene.set("p", std::vector<double>{0.0});
  scene.set("q", std::vector<double>{1.0});
  scene.step(steps);
  return scene.error("u", [](double) { return std::exp(-2.0); }) + scene.error("p", [](double) {
    return std::sin(1.0);
  }) + scene.error("q", [](double) { return std::cos(1.0); });
}

TEST(LoweringOrder, TimeSchemesWithTimeInTheEquation) {
  for (const model::TimeMethod& method : model::time_methods()) {
    if (method.stages.empty()) continue;
    const int steps = method.order < 3 ? 64 / method.order : 16;
    EXPECT_NEAR(scene_run::order([&](int n) { return time_error(&method, n); }, steps), method.order,
                method.order < 5 ? 0.15 : 0.25)
        << method.name;
  }
}

TEST(LoweringOrder, RungeKuttaStepsHaveTheirStabilityPolynomials) {
  const double z = -0.3;
  const auto factor = [&](model::TimeScheme scheme) {
    model::Problem p = problem({state("u", z * u)}, {1});
    p.scheme.time = scheme;
    p.step = 1;
    Scene scene(p);
    scene.set("u", std::vector<double>{1.0});
    scene.step(1);
    return scene.get("u")[0];
  };
  EXPECT_NEAR(factor(model::time_method("euler")), 1 + z, 1e-15);
  EXPECT_NEAR(factor(model::time_method("rk2")), 1 + z + z * z / 2, 1e-15);
  EXPECT_NEAR(factor(model::time_method("rk4")), 1 + z + z * z / 2 + z * z * z / 6 + z * z * z * z / 24, 1e-15);
  EXPECT_NEAR(factor(model::time_method("ssp_rk3")), 1 + z + z * z / 2 + z * z * z / 6, 1e-15);
}

TEST(LoweringOrder, DecayingModeInSpaceAndTime) {
  const auto error = [](int order, int cells) {
    model::Problem p = problem({state("u", param("D") * lap(u))}, {cells}, 2 * pi);
    p.scheme = central(order);
    const double h = p.axes[0].spacing();
    const int steps = static_cast<int>(std::ceil(1 / (0.25 * h * h)));
    p.step = 1.0 / steps;
    Scene scene(p, {{"D", 1.0}});
    scene.set("u", [](double x) { return std::sin(x); });
    scene.step(steps);
    return scene.error("u", [](double x) { return std::exp(-1.0) * std::sin(x); });
  };
  EXPECT_NEAR(scene_run::order([&](int n) { return error(2, n); }, 12), 2, 0.15);
  EXPECT_NEAR(scene_run::order([&](int n) { return error(4, n); }, 12), 4, 0.15);
}

TEST(LoweringOrder, FluxFormConservesTheSum) {
  for (const int order : {2, 4}) {
    model::Problem p = problem({state("u", d(kappa * d(u)) - d(u * u / 2.0))}, {40}, 1);
    p.scheme = central(order);
    p.coefficients = {{"kappa", {}}};
    p.observables = {{"mass", sum(u), {}}, {"square", integral(u * u), {}}};
    p.step = 1e-4;
    Scene scene(p);
    scene.set("u", [](double x) { return 1 + std::sin(2 * pi * x) + std::cos(6 * pi * x); });
    scene.set("kappa", [](double x) { return 1 + 0.5 * std::sin(4 * pi * x); });
    const auto before = scene.run("s_observe");
    scene.step(50);
    const auto after = scene.run("s_observe");
    EXPECT_NEAR(before.at("mass"), 40, 1e-12);
    EXPECT_NEAR(before.at("square"), 2, 1e-12);
    EXPECT_NEAR(after.at("mass"), before.at("mass"), 1e-12);
    EXPECT_LT(after.at("square"), 0.95 * before.at("square"));
  }
}

/// numerics.md section 2: slab [0, 1], u = 1 at the start, 0 at both ends, D = 1.
double slab_error(int cells, double time, double quarter, double middle) {
  model::Problem p = problem({state("u", lap(u))}, {cells}, 1, Topology::bounded);
  p.states[0].initial.formula = 1.0;
  p.scheme.time = model::time_method("rk4");
  const int steps = static_cast<int>(std::lround(time * cells * cells / 0.4));
  p.step = time / steps;
  Scene scene(p);
  scene.run("s_initial");
  scene.step(steps);
  const std::vector<double> values = scene.get("u");
  // 0.25 and 0.5 lie between cells: fourth-order interpolation keeps the scheme's own error
  const auto between = [&](int i) { return (9 * (values[i - 1] + values[i]) - values[i - 2] - values[i + 1]) / 16; };
  return std::max(std::abs(between(cells / 4) - quarter), std::abs(between(cells / 2) - middle));
}

TEST(LoweringOrder, HeatSlabWithBoundaryValues) {
  const auto error = [](int n) { return slab_error(n, 0.1, 0.335596596136, 0.47448746038); };
  EXPECT_NEAR(scene_run::order(error, 20), 2, 0.15);
  // the first mode decays at (2 - 2 cos(pi h))/h^2 and starts too large: relative error h^2 (pi^4 t/12 + pi^2/24)
  EXPECT_NEAR(error(40), 3.6e-4, 0.1e-4);
  EXPECT_LT(slab_error(40, 0.05, 0.55317589185, 0.772311606859), 4e-4);
  EXPECT_LT(slab_error(40, 0.01, 0.922900014529, 0.999186095965), 1e-3);
}

TEST(LoweringOrder, InsulatedSlabKeepsItsMean) {
  model::Problem p = problem({state("u", lap(u))}, {20}, 1, Topology::bounded);
  p.states[0].boundary[0].low.kind = p.states[0].boundary[0].high.kind = dpde::SideKind::zero_gradient;
  p.observables = {{"total", mean(u), {}}};
  p.step = 5e-4;
  Scene scene(p);
  scene.set("u", [](double x) { return x; });
  scene.step(400);
  EXPECT_NEAR(scene.run("s_observe").at("total"), 0.5, 1e-13);
  // the slowest mode: 0.5 - 4/pi^2 cos(pi x) e^(-pi^2 t)
  EXPECT_LT(
      scene.error("u", [](double x) { return 0.5 - 4 / (pi * pi) * std::cos(pi * x) * std::exp(-pi * pi * 0.2); }),
      1e-3);
}

}  // namespace
}  // namespace lowering_order
