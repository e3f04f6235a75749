// SPDX-License-Identifier: Apache-2.0
// Convection against linear theory and steady rolls, both from Chebyshev-Fourier series: growth rates of the state at
// rest at k = 3.117, Pr = 0.71, and the heat flux.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::SceneResult;

/// Between plates; `n` cells high. Length unit: the height; time unit: height squared over thermal diffusivity.
std::vector<double> upwards(double rayleigh, int n, double amplitude, double end, int steps_a_unit) {
  const std::string text = fmt::format(R"(
model convection {{
  vector u on faces
  field p, T
  param Ra, Pr
  dt(u) = -advect(u, u) - grad(p) + Pr*lap(u) + (0, Ra*Pr*interpolate(T))
  dt(T) = -advect(u, T) + lap(T)
  0 = div(u) gives p
}}
scene rolls : convection {{
  grid x = 0 .. 2*pi/3.117, cells {}, periodic
  grid y = 0 .. 1, cells {}
  Ra = {}
  Pr = 0.71
  initial u = 0
  initial T = 0.5 - y + {}*cos(3.117*x)*sin(pi*y)
  boundary u: y = 0
  boundary T: y.low = 0.5, y.high = -0.5
  time 0 .. {}, step 1/{}
}}
)",
                                       2 * n, n, rayleigh, amplitude, end, steps_a_unit);
  return run_scene(text, "rolls", {}).state.at("u.y");
}

double growth_rate(double rayleigh, int n) {
  const auto size = [&](double end) {
    const std::vector<double> v = upwards(rayleigh, n, 1e-6, end, 8 * n * n);
    return std::sqrt(std::inner_product(v.begin(), v.end(), v.begin(), 0.0));
  };
  return std::log(size(1) / size(0.75)) / 0.25;
}

TEST(Convection, GrowsFromRestAsLinearTheorySays) {
  for (const auto& [rayleigh, rate] : {std::pair{2000.0, 1.88014390}, {2500.0, 4.81220605}}) {
    const double coarse = growth_rate(rayleigh, 12), fine = growth_rate(rayleigh, 24);
    EXPECT_NEAR(fine + (fine - coarse) / 3, rate, 0.01) << rayleigh;
    EXPECT_NEAR(std::log2((coarse - rate) / (fine - rate)), 2, 0.1) << rayleigh;
  }
}

/// Below the critical Rayleigh number, 1707.76, motion decays.
TEST(Convection, RestIsStableBelowTheCriticalRayleighNumber) {
  const double coarse = growth_rate(1600, 12), fine = growth_rate(1600, 24);
  EXPECT_LT(fine + (fine - coarse) / 3, -0.1);
}

}  // namespace
}  // namespace dpde
