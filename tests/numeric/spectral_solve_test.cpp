// SPDX-License-Identifier: Apache-2.0
// Equations solved in the step by Fourier series: each mode of the right-hand side is divided by the operator's symbol.
#include <gtest/gtest.h>

#include <string>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Taylor-Green vortices, which only the viscous operator changes; and waves whose right-hand side solves k*phi'' -
/// r*phi = -q: exp(i m x) grows at the rate 1/(k*m^2 + r). The one with m = 4 has two cells.
const std::string solved = R"(
model flow {
  field omega
  param nu
  solve lap(psi) = -omega for psi
  let v = (dy(psi), -dx(psi))
  dt(omega) = -advect(v, omega) + nu*lap(omega)
}
model response {
  field q
  param k, r
  solve k*lap(phi) - r*phi = -q for phi
  dt(q) = phi
}
scheme waves { dx = spectral; lap = spectral; advect = spectral; time = rk4 }
scene vortices : flow with waves {
  grid x = 0 .. 2*pi, cells 12, periodic
  grid y = 0 .. 2*pi, cells 10, periodic
  nu = 0.01
  initial omega = 3 + 2*sin(x)*sin(y)
  exact omega = 3 + 2*sin(x)*sin(y)*exp(-2*nu*t)
  time 0 .. 1, step 0.05
}
scene wave : response with waves {
  grid x = 0 .. 2*pi, cells 8, periodic
  k = 0.4
  r = 1.3
  initial q = sin(x) + 2 + sin(4*x)
  exact q = exp(t/(k + r))*sin(x) + 2*exp(t/r) + exp(t/(16*k + r))*sin(4*x)
  time 0 .. 0.5, step 1/200
}
)";

TEST(SpectralSolve, IsExactForWavesOfTheGrid) {
  EXPECT_LT(run_scene(solved, "vortices").l2.at("omega"), 1e-11);
  EXPECT_LT(run_scene(solved, "vortices", {{"time", "etdrk4"}}).l2.at("omega"), 1e-13);
  EXPECT_LT(run_scene(solved, "wave").l2.at("q"), 1e-10);
}

TEST(SpectralSolve, BackEndsAgree) {
  for (const std::string scene : {"vortices", "wave"}) {
    const Overrides three_steps{{"end", scene == "wave" ? "3/200" : "0.15"}};
    const auto state = [&](driver::Backend backend) {
      return run_scene(solved, scene, three_steps, backend).state.begin()->second;
    };
    const std::vector<double> wanted = state(driver::Backend::interpreter);
    for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
      const std::vector<double> found = state(backend);
      ASSERT_EQ(found.size(), wanted.size());
      for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], wanted[i], 1e-13) << scene;
    }
  }
}

/// Also on all small grids, and second derivatives.
TEST(SpectralSolve, HasExactDerivatives) {
  const std::string start = "task t : ", of_vortices = "minimise mean(psi^2) + mean(omega^4) }\n",
                    of_wave = "minimise mean(q^3) + mean(phi^2) }\n";
  expect_certified(solved + start + "vortices { unknown nu\nunknown initial omega\n" + of_vortices, true);
  expect_certified(solved + start + "wave { unknown k\nunknown r\nunknown initial q\n" + of_wave, true);
}

/// With finite differences for the same operator it is the same equation, solved by a matrix.
TEST(SpectralSolve, IsTheLimitOfSolvesByDifferences) {
  const std::string differences =
      "model m { field omega; solve lap(psi) - psi = -omega for psi; dt(omega) = psi }\n"
      "scene s : m { grid x = 0 .. 2*pi, cells 32, periodic\n initial omega = exp(sin(x))\n"
      "time 0 .. 1, step 0.1 }\n";
  const std::vector<double> waves = run_scene(differences, "s", {{"lap", "spectral"}}).state.at("omega");
  const std::vector<double> eighth = run_scene(differences, "s", {{"lap", "central(8)"}}).state.at("omega");
  for (std::size_t i = 0; i < waves.size(); ++i) EXPECT_NEAR(waves[i], eighth[i], 1e-7);
}

}  // namespace
}  // namespace dpde::testing
