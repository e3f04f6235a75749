// SPDX-License-Identifier: Apache-2.0
// Published and closed-form values of forward runs and gradients, on the compiled kernels.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::read_file;
using testing::run_scene;
using testing::task_gradient;

std::string example(const std::string& path) {
  return read_file(std::string(DPDE_SOURCE_DIR) + "/dsl-examples/" + path);
}

/// Semi-Lagrangian Burgers of the published notebook: u(t = 1) in the first five cells, from independent code.
TEST(Burgers, ForwardRunOfTheNotebook) {
  for (const auto backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    const auto u = run_scene(example("burgers_1d/burgers.dpde"), "wave", {}, backend).state.at("u");
    const double expected[] = {0.00572276, 0.01716714, 0.02861029, 0.04005201, 0.0514921};
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(u[i], expected[i], 1e-7);
  }
}

/// u0 = sin(pi x), u = 0 at both ends, nu = 0.1: Fourier-Bessel values at t = 0.5, approached at second order.
TEST(Burgers, BetweenWallsApproachesTheClosedForm) {
  std::vector<double> errors;
  for (const int n : {50, 150}) {  // n = 2 mod 4: 1/4 and 3/4 are cell centres
    const auto u = run_scene(example("burgers_1d/burgers.dpde"), "ends", {{"cells", std::to_string(n)}}).state.at("u");
    const double quarter = u[(n - 2) / 4] - 0.270790071694, three = u[(3 * n - 2) / 4] - 0.554110693017;
    errors.push_back(std::hypot(quarter, three));
  }
  EXPECT_LT(errors[1], 1e-4);
  EXPECT_NEAR(std::log(errors[0] / errors[1]) / std::log(3), 2, 0.15);
}

/// Slab of heat 1 between walls of 0 (series): u(1/4), t = 0.05.
TEST(Heat, SlabApproachesTheSeries) {
  std::vector<double> errors;
  for (const int n : {54, 162}) {  // away from the cells at the jumps on the walls
    const auto u = run_scene(example("heat/heat.dpde"), "slab",
                             {{"cells", std::to_string(n)}, {"step", "1/64000"}, {"time", "rk4"}})
                       .state.at("u");
    errors.push_back(std::abs(u[(n - 2) / 4] - 0.55317589185));
  }
  EXPECT_LT(errors[1], 5e-5);
  EXPECT_NEAR(std::log(errors[0] / errors[1]) / std::log(3), 2, 0.15);
}

/// Limit of a quantity of second order from its values at spacings h and h/2.
double extrapolated(double coarse, double fine) { return fine + (fine - coarse) / 3; }

/// J = 1/2 int u(1)^2 for u0 = sin x + sin(3x)/2, D = 0.1: closed forms of J, dJ/dD and dJ/du0.
TEST(Gradient, OfHeatReachesTheClosedForms) {
  const std::string text = example("heat/heat.dpde");
  const Overrides precise{{"time", "rk4"}, {"lap", "central4"}};
  const auto result = task_gradient(text, "conductivity", precise);
  EXPECT_NEAR(result.loss, 1.35097198117935, 2e-6);
  EXPECT_NEAR(result.gradient.at("kappa")[0], -3.74054750812569, 2e-5);
  const auto& g = result.gradient.at("u");
  const double h = 2 * std::numbers::pi / g.size();
  for (size_t i = 0; i < g.size(); ++i) {
    const double x = (i + 0.5) * h;
    EXPECT_NEAR(g[i] / h, std::exp(-0.2) * std::sin(x) + 0.5 * std::exp(-1.8) * std::sin(3 * x), 2e-6);
  }
}

/// J = 1/2 int (u(1) - sin x)^2, u0 = sin x, c = 1.
TEST(Gradient, OfAdvectionReachesTheClosedForm) {
  const auto result = task_gradient(example("advection/advection.dpde"), "speed");
  EXPECT_NEAR(result.loss, 1.44418289875682, 1e-6);
  EXPECT_NEAR(result.gradient.at("c")[0], 2.64355906408146, 2e-6);
}

/// J = 1/2 int u(0.5)^2 of Burgers between walls, nu = 0.1.
TEST(Gradient, OfBurgersReachesTheConvergedValue) {
  const std::string text = example("burgers_1d/burgers.dpde");
  const auto coarse = task_gradient(text, "viscosity", {{"cells", "64"}}),
             fine = task_gradient(text, "viscosity", {{"cells", "128"}});
  EXPECT_NEAR(extrapolated(coarse.loss, fine.loss), 0.079544162102809, 1e-7);
  EXPECT_NEAR(extrapolated(coarse.gradient.at("nu")[0], fine.gradient.at("nu")[0]), -0.735386392, 1e-5);
}

/// The published inverse problem: its first gradient, from u0 = 0.
TEST(Gradient, OfThePublishedReconstruction) {
  const char* folder = std::getenv("DPDE_REFERENCE_DATA");
  if (!folder) GTEST_SKIP() << "DPDE_REFERENCE_DATA is not set: the published target is not here";
  const auto result =
      task_gradient(example("burgers_1d/burgers.dpde"), "published", {}, std::string(folder) + "/burgers.dpde");
  EXPECT_NEAR(result.loss, 0.382915, 1e-6);
  double largest = 0, square = 0;
  for (const double g : result.gradient.at("u")) {
    largest = std::max(largest, std::abs(g));
    square += g * g;
  }
  EXPECT_NEAR(largest, 0.0152451610, 1e-9);
  EXPECT_NEAR(std::sqrt(square), 0.1091783204, 1e-9);
}

}  // namespace
}  // namespace dpde
