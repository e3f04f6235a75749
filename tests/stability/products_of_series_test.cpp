// SPDX-License-Identifier: Apache-2.0
// Fourier series of products whose coefficients vary: limits are those of the same equations written otherwise, and of
// runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/waves/wave_sum.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// psi = cos(x + 2*y) and noise of 1e-8: a steady flow of wind (2, -1), with these equations for it.
std::unique_ptr<driver::Session> shear(const std::string& equations, const std::string& scheme, double step = 0.02,
                                       int steps = 120) {
  return open_scene(fmt::format(
      "model v {{ field w; solve lap(psi) = w for psi; {} }}\nscheme c {{ lap = spectral; dx = spectral; {} }}\n"
      "scene s : v with c {{\n  grid x = 0 .. 2*pi, cells 32, periodic\n  grid y = 0 .. 2*pi, cells 32, periodic\n"
      "  initial w = -5*cos(x + 2*y) + 1e-8*noise(1)\n  time 0 .. {}*{}, step {}\n}}\n",
      equations, scheme, steps, step, step));
}

double limit_of(driver::Session& session) {
  const StabilityReport verdict = verdict_of(session);
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << verdict.why;
  return verdict.limit.step;
}

constexpr const char* at_point = "dt(w) = -dx(psi)*dy(w) + dy(psi)*dx(w)";
/// Slopes of psi are known by its neighbours: along y they are sin(2*h)/(2*h) of its own, with h = 2*pi/32.
constexpr double by_neighbours = 0.026;
constexpr const char* bracket = "dt(w) = -bracket(psi, w)";

/// The fastest wave is the shortest that is kept along both axes, of the wind (2, -1).
TEST(ProductsOfSeries, BracketHasTheLimitOfItsWind) {
  const double limit = limit_of(*shear(bracket, "time = rk4; dealias = two_thirds"));
  EXPECT_NEAR(limit, limit_of(*shear(at_point, "time = rk4; dealias = two_thirds")), by_neighbours / 3 * limit)
      << "a third of it is psi under derivatives";
  constexpr double k = 10, frequency = 3 * k * (1 - 5 / (2 * k * k));
  EXPECT_NEAR(limit, 2.8284 / frequency, 1.5e-2 * limit);
}

/// The derivatives in which psi stands, too: in those of psi times a slope of w it is the wind by its slope alone.
TEST(ProductsOfSeries, LimitIsOneInAllForms) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: 28 verdicts";
  for (const std::string scheme : {"time = rk4", "time = ssp_rk3", "time = ab3", "time = etdrk4"}) {
    const std::string more = scheme == "time = etdrk4" ? " + 1e-3*lap(w)" : "", all = scheme + "; dealias = two_thirds";
    const double expected = limit_of(*shear(at_point + more, all));
    for (const std::string form :
         {"dt(w) = -bracket(psi, w)", "dt(w) = bracket(w, psi)", "dt(w) = -dx(psi*dy(w)) + dy(psi*dx(w))",
          "dt(w) = dx(w*dy(psi)) - dy(w*dx(psi))", "let v = (-dy(psi), dx(psi)); dt(w) = -div(v*w)",
          "let v = (-dy(psi), dx(psi)); dt(w) = -0.5*(dot(v, grad(w)) + div(v*w))"}) {
      const double limit = limit_of(*shear(form + more, all));
      EXPECT_NEAR(limit, expected, by_neighbours * expected) << scheme << ": " << form;
    }
  }
}

/// Of one field about formulas, where nothing is solved for: what fluxes and what slopes of coefficients make of it.
TEST(ProductsOfSeries, FluxesAreAdvectionAndWhatItGathers) {
  const auto limit_with = [](const std::string& rate) {
    return limit_of(*open_scene(
        fmt::format("model m {{ field u; dt(u) = {} }}\nscheme c {{ time = rk4; dx = spectral; lap = spectral; "
                    "dealias = two_thirds }}\nscene s : m with c {{ grid x = 0 .. 2*pi, cells 48, periodic; "
                    "initial u = sin(x); time 0 .. 1, step 1e-3 }}\n",
                    rate)));
  };
  const auto is_of_day = [](const std::string& flux) { return flux == "-dx((2 + sin(x))*u)"; };
  for (const auto& [flux, otherwise] :
       {std::pair{"-dx((2 + sin(x))*u)", "-(2 + sin(x))*dx(u) - cos(x)*u"},
        {"dx((2 + sin(x))*dx(u))", "(2 + sin(x))*dx(dx(u)) + cos(x)*dx(u)"},
        {"dx(dx((2 + sin(x))*u))", "(2 + sin(x))*dx(dx(u)) + 2*cos(x)*dx(u) - sin(x)*u"},
        {"-dx((2 + sin(x))^2*u)", "-(2 + sin(x))^2*dx(u) - 2*cos(x)*(2 + sin(x))*u"},
        {"-dx(u^2/2)", "-u*dx(u)"}}) {
    if (!testing::is_thorough() && !is_of_day(flux)) continue;
    const double expected = limit_with(otherwise);
    EXPECT_NEAR(limit_with(flux), expected, 5e-3 * expected) << flux;
  }
}

/// Functions of polynomials along two axes, against differences of what they make of waves.
TEST(ProductsOfSeries, DerivativesOfMultipliersAreThose) {
  using Kind = WaveFunction::Kind;
  const std::vector<NumberMonomial> argument{{0.3, {2, 0, 0}}, {0.2, {0, 2, 0}}, {-0.5, {0, 0, 0}}},
      factor{{1.5, {1, 0, 0}}, {0.7, {1, 2, 0}}, {2, {0, 0, 0}}};
  for (const WaveFunction& function : {WaveFunction{}, WaveFunction{Kind::phi, 0}, WaveFunction{Kind::phi, 2},
                                       WaveFunction{Kind::inverse, 1}, WaveFunction{Kind::inverse, 2}}) {
    const WaveMultiplier by{function, function ? argument : std::vector<NumberMonomial>{}, factor};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      constexpr double difference = 1e-5;
      std::array<double, 3> angles{0.8, -1.1, 0}, up = angles, down = angles;
      up[axis] += difference, down[axis] -= difference;
      const std::complex<double> expected = (by.at(up) - by.at(down)) / std::complex<double>(0, 2 * difference);
      std::complex<double> sum = 0;
      for (const WaveMultiplier& part : by.derivatives(axis, by.argument)) sum += part.at(angles);
      EXPECT_LT(std::abs(sum - expected), 1e-8 * std::abs(expected)) << function.number << ", axis " << axis;
    }
  }
}

bool dies(const std::string& equations, double step, int steps) {
  const auto session = shear(equations, "time = rk4; dealias = two_thirds", step, steps);
  try {
    session->rollout().run();
    std::vector<double> values(session->workspace().cell_count());
    copy_out(session->workspace().layout(), session->rollout().final_states()[0], values);
    return !std::ranges::all_of(values, [](double value) { return std::abs(value) < 10; });
  } catch (const std::exception&) {
    return true;
  }
}

/// Waves that are fastest are so at a crest of the wind alone, and take some room about it: the run's limit is larger.
TEST(ProductsOfSeries, BracketRunsUpToItsLimit) {
  const double limit = limit_of(*shear(bracket, "time = rk4; dealias = two_thirds"));
  EXPECT_FALSE(dies(bracket, 0.97 * limit, 400));
  EXPECT_TRUE(dies(bracket, 1.12 * limit, 400));
}

}  // namespace
}  // namespace dpde::stability
