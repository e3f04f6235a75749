// SPDX-License-Identifier: Apache-2.0
// Waves of two cells, which only even grids have: their derivatives of odd order are 0 at the cell centres, and
// functions of derivatives, as in exponential steps, use this value.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Odd derivatives in the linear part, in the rest, in both, and mixed with even ones.
const std::string equations_of_short_waves[] = {"c*dx(u) + 1e-4*d(u, x, 3)", "c*dx(u) - u^2", "c*dx(u) - 0.5*dx(u^2)",
                                                "0.01*lap(u) - c*dx(u) + 0.02*dx(u^2) - 1e-3*d(u, x, 3)"};

std::string scene_of(const std::string& equation, int cells) {
  return fmt::format(
      "model m {{ field u; param c = 1; dt(u) = {} }}\nscheme q {{ dx = spectral; lap = spectral; time = etdrk4 }}\n"
      "scene s : m with q {{ grid x = 0 .. 1, cells {}, periodic\n"
      "  initial u = 0.3*cos(16*pi*x) + 0.5*sin(2*pi*x) + 0.2*noise(3)\n  time 0 .. 0.08, step 0.02 }}\n",
      equation, cells);
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

/// Against Runge-Kutta steps of the same derivatives that are so short that they have no error.
TEST(ShortestWave, ExponentialStepsHaveTheirOrder) {
  for (const std::string& equation : equations_of_short_waves) {
    for (const int cells : {15, 16}) {
      const std::string text = scene_of(equation, cells);
      const std::vector<double> exact = run_scene(text, "s", {{"time", "rk4"}, {"step", "1/40000"}}).state.at("u");
      for (const auto& [time, order] : {std::pair{"etdrk2", 2.0}, {"etdrk4", 4.0}}) {
        std::vector<double> errors;
        for (const char* step : {"1/200", "1/400"})
          errors.push_back(distance(run_scene(text, "s", {{"time", time}, {"step", step}}).state.at("u"), exact));
        if (errors[1] < 1e-11) continue;  // the linear part alone is exact
        EXPECT_NEAR(std::log2(errors[0] / errors[1]), order, 0.3) << equation << ", " << cells << " cells, " << time;
      }
    }
  }
}

/// Alone it stays: only odd derivatives act on it.
TEST(ShortestWave, IsNotDampedByOddDerivatives) {
  const std::string text =
      "model m { field u; dt(u) = dx(u) - 0.1*d(u, x, 3) }\n"
      "scheme q { dx = spectral; lap = spectral; time = etdrk4 }\n"
      "scene s : m with q { grid x = 0 .. 1, cells 8, periodic; initial u = cos(8*pi*(x - 1/16))\n"
      "  time 0 .. 1, step 0.1 }\n";
  const std::vector<double> u = run_scene(text, "s").state.at("u");
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(u[i], i % 2 == 0 ? 1 : -1, 1e-13) << i;
}

/// By each coefficient, also second derivatives.
TEST(ShortestWave, DerivativesAreExact) {
  for (const std::string& equation : equations_of_short_waves) {
    for (const char* cells : {"7", "8"}) {
      const std::string task = "task t : s { unknown c; unknown initial u; minimise mean(u^3) + mean(u^2) }\n";
      expect_certified(scene_of(equation, std::stoi(cells)) + task, true);
    }
  }
}

/// By all coefficients, against differences of the loss: no product of odd derivatives is treated as an even one.
TEST(ShortestWave, GradientsAreThoseOfDifferences) {
  const std::string text =
      scene_of(equations_of_short_waves[2], 16) + "task g : s { unknown c; minimise mean(u^3) + mean(u^2) }\n";
  constexpr double e = 1e-5;
  const double gradient = task_gradient(text, "g").gradient.at("c")[0];
  const double above = task_loss(text, "g", {{"c", fmt::format("{}", 1 + e)}}),
               below = task_loss(text, "g", {{"c", fmt::format("{}", 1 - e)}});
  EXPECT_NEAR(gradient, (above - below) / (2 * e), 1e-7 * std::abs(gradient) + 1e-9);
}

}  // namespace
}  // namespace dpde::testing
