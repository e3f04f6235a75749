// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series and exponential time schemes, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "dpde/wave_functions.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;

/// The solution that Cole and Hopf's transformation gives for a phi of one wave; periodic, and smooth.
const std::string burgers_on_ring = R"(
model burgers_on_ring { field u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
model product { field u; param nu; dt(u) = -0.5*dx(u^2) + nu*lap(u) }
scheme waves { advect = spectral; dx = spectral; lap = spectral; time = rk4 }
scene line : burgers_on_ring with waves {
  grid x = 0 .. 2*pi, cells 48, periodic
  nu = 0.3
  initial u = 2*nu*sin(x)/(2 + cos(x))
  exact   u = 2*nu*exp(-nu*t)*sin(x)/(2 + exp(-nu*t)*cos(x))
  time 0 .. 1, step 1/200
}
scene flux : product with waves {
  grid x = 0 .. 2*pi, cells 48, periodic
  nu = 0.3
  initial u = 2*nu*sin(x)/(2 + cos(x))
  exact   u = 2*nu*exp(-nu*t)*sin(x)/(2 + exp(-nu*t)*cos(x))
  time 0 .. 1, step 1/200
}
)";

const std::string two_axes = R"(
model mixed { field u; param a; dt(u) = -advect((1, a), u) + 0.1*d(d(u, x), y) + 0.2*lap(u) - 0.01*lap(lap(u)) }
scheme waves { advect = spectral; dx = spectral; lap = spectral; time = rk4 }
scene plane : mixed with waves {
  grid x = 0 .. 2*pi, cells 9, periodic
  grid y = 0 .. 4*pi, cells 12, periodic
  a = 2
  initial u = sin(x + y/2)
  exact   u = exp(-(0.05 + 0.2*1.25 + 0.01*1.25^2)*t)*sin(x - t + (y - a*t)/2)
  time 0 .. 0.5, step 1/200
}
scene block : mixed with waves {
  grid x = 0 .. 2*pi, cells 5, periodic
  grid y = 0 .. 4*pi, cells 6, periodic
  a = 2
  initial u = sin(x + y/2)
  exact   u = exp(-(0.05 + 0.2*1.25 + 0.01*1.25^2)*t)*sin(x - t + (y - a*t)/2)
  time 0 .. 0.5, step 1/200
}
)";

TEST(Phi, HasTheValuesOfItsIntegral) {
  const double e = std::numbers::e;
  EXPECT_NEAR(phi(0, 1.0).real(), e, 1e-15);
  EXPECT_NEAR(phi(1, -1.0).real(), 1 - 1 / e, 1e-15);
  EXPECT_NEAR(phi(2, -1.0).real(), 1 / e, 1e-15);
  EXPECT_NEAR(phi(3, -1.0).real(), 0.5 - 1 / e, 1e-15);
  EXPECT_NEAR(phi(3, 0.0).real(), 1.0 / 6, 1e-16);
  EXPECT_NEAR(phi(1, 1e-9).real(), 1 + 0.5e-9, 1e-16);
  const std::complex<double> half_turn = phi(1, {0, std::numbers::pi});  // (exp(i pi) - 1)/(i pi)
  EXPECT_NEAR(half_turn.real(), 0, 1e-15);
  EXPECT_NEAR(half_turn.imag(), 2 / std::numbers::pi, 1e-15);
  for (const int number : {1, 2, 3, 4}) {  // Simpson's rule for the integral, on both sides of the switch to the series
    for (const std::complex<double> z :
         {std::complex<double>{1.4, 0}, {1.6, 0}, {-2.4, 1}, {-2.7, 1}, {-20, 3}, {0, 9}}) {
      constexpr int intervals = 20000;
      std::complex<double> sum = 0;
      double factorial = 1;
      for (int k = 2; k < number; ++k) factorial *= k;
      for (int i = 0; i <= intervals; ++i) {
        const double s = static_cast<double>(i) / intervals;
        const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
        sum += weight * std::exp((1 - s) * z) * std::pow(s, number - 1) / factorial;
      }
      sum /= 3.0 * intervals;
      EXPECT_LT(std::abs(phi(number, z) - sum), 2e-13 * std::abs(sum)) << number << " at " << z;
    }
  }
}

/// The error decreases faster than any power down to rounding (numerics.md, section 17).
TEST(Spectral, ErrorsFallFasterThanAnyPower) {
  for (const std::string scene : {"line", "flux"}) {
    std::vector<double> errors;
    for (const std::string cells : {"8", "16", "32", "48"})
      errors.push_back(run_scene(burgers_on_ring, scene, {{"cells", cells}, {"step", "1/2000"}}).l2.at("u"));
    EXPECT_LT(errors[1], errors[0] / 50) << scene;
    EXPECT_LT(errors[2], errors[1] / 2000) << scene;
    EXPECT_LT(errors[3], 1e-12) << scene;
  }
}

/// Waves of the grid are exact, also mixed and fourth derivatives, and on odd numbers of cells.
TEST(Spectral, IsExactForWavesOfTheGrid) {
  EXPECT_LT(run_scene(two_axes, "plane").l2.at("u"), 1e-10);
  EXPECT_LT(run_scene(two_axes, "block").l2.at("u"), 1e-10);
  EXPECT_LT(run_scene(two_axes, "block", {{"cells.x", "3"}, {"cells.y", "3"}}).l2.at("u"), 1e-10);
}

TEST(Spectral, BackEndsAgree) {
  for (const Overrides& scheme : {Overrides{}, {{"time", "etdrk4"}, {"dealias", "two_thirds"}}}) {
    Overrides short_run{{"end", "0.05"}, {"cells", "12"}};
    short_run.insert(scheme.begin(), scheme.end());
    const std::vector<double> wanted =
        run_scene(burgers_on_ring, "line", short_run, driver::Backend::interpreter).state.at("u");
    for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
      const std::vector<double> found = run_scene(burgers_on_ring, "line", short_run, backend).state.at("u");
      ASSERT_EQ(found.size(), wanted.size());
      for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], wanted[i], 1e-13);
    }
  }
}

double observed_order(const std::string& scene, const std::string& time, double step) {
  std::vector<double> errors;
  for (const double part : {1.0, 2.0, 4.0})
    errors.push_back(
        run_scene(burgers_on_ring, scene, {{"time", time}, {"step", std::to_string(step / part)}}).l2.at("u"));
  EXPECT_GT(errors[2], 1e-13) << scene << " " << time;
  return std::log2(errors[1] / errors[2]);
}

TEST(Exponential, HasItsOrderInTime) {
  for (const std::string scene : {"line", "flux"}) {
    EXPECT_NEAR(observed_order(scene, "etdrk2", 0.05), 2, 0.15) << scene;
    EXPECT_NEAR(observed_order(scene, "etdrk4", 0.25), 4, 0.15) << scene;
  }
}

/// A linear equation is solved exactly, with any step.
TEST(Exponential, IsExactForLinearEquations) {
  for (const std::string time : {"etdrk2", "etdrk4"})
    EXPECT_LT(run_scene(two_axes, "plane", {{"time", time}, {"step", "0.5"}}).l2.at("u"), 1e-13) << time;
}

/// Linear parts without derivatives, or empty ones: no axis is transformed.
TEST(Exponential, TakesReactionsCellByCell) {
  const std::string grids[] = {"grid x = 0 .. 2, cells 9, periodic",
                               "grid x = 0 .. 2, cells 5, periodic; grid y = 0 .. 1, cells 4, periodic",
                               "grid x = 0 .. 2, cells 1, periodic; grid y = 0 .. 1, cells 6, periodic"};
  for (const std::string rate : {"-2*u", "-2*u + 0.5*sin(u)", "0.1*div(kap*grad(u))"}) {
    for (const std::string& grid : grids) {
      const std::string text = "model m { field u; coefficient kap; dt(u) = " + rate +
                               " }\nscheme waves { time = etdrk2 }\nscene s : m with waves { " + grid +
                               "; kap = 1 + 0.3*sin(pi*x); initial u = 2 + cos(pi*x)" +
                               "; exact u = (2 + cos(pi*x))*exp(-2*t); time 0 .. 0.08, step 0.02 }\n" +
                               "task t : s { unknown initial u; minimise mean(u^2) at t = 0.08 }";
      for (const std::string time : {"etdrk2", "etdrk4"}) {
        const Overrides scheme{{"time", time}};
        const std::vector<double> wanted = run_scene(text, "s", scheme, driver::Backend::interpreter).state.at("u");
        for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
          if (backend == driver::Backend::cpp && !testing::is_thorough()) continue;  // each run calls a C++ compiler
          const testing::SceneResult found = run_scene(text, "s", scheme, backend);
          for (std::size_t i = 0; i < wanted.size(); ++i)
            EXPECT_NEAR(found.state.at("u")[i], wanted[i], 1e-13) << text << time;
          if (rate == "-2*u") EXPECT_LT(found.l2.at("u"), 1e-14) << text << time;
        }
        EXPECT_EQ(testing::task_gradient(text, "t", scheme).gradient.size(), 1) << text << time;  // certified
      }
    }
  }
}

/// The equation preserves oddness about x = 8 pi: u(8 pi + y) = -u(8 pi - y). Rounding grows with the flow.
TEST(Exponential, KeepsTheSymmetriesOfKuramotoAndSivashinsky) {
  const std::string ks = R"(
model ks { field u; dt(u) = -0.5*dx(u^2) - lap(u) - lap(lap(u)) }
scheme waves { dx = spectral; lap = spectral; dealias = two_thirds; time = etdrk4 }
scene line : ks with waves {
  grid x = 0 .. 32*pi, cells 128, periodic
  initial u = cos(x/16)*(1 + sin(x/16))
  time 0 .. 50, step 0.25
}
)";
  const std::vector<double> u = run_scene(ks, "line").state.at("u");
  double largest = 0, asymmetry = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    largest = std::max(largest, std::abs(u[i]));
    asymmetry = std::max(asymmetry, std::abs(u[i] + u[(u.size() / 2 + u.size() - 1 - i) % u.size()]));
  }
  EXPECT_GT(largest, 2);
  EXPECT_LT(largest, 4);
  EXPECT_LT(asymmetry, 1e-9);
}

/// The filtered states have no waves of three cells or shorter.
TEST(Dealias, CutsStates) {
  for (const std::string time : {"euler", "rk4", "ssp_rk3", "etdrk4"}) {
    const std::vector<double> u =
        run_scene(burgers_on_ring, "line",
                  {{"time", time}, {"dealias", "two_thirds"}, {"cells", "24"}, {"step", "0.005"}})
            .state.at("u");
    for (int m = 0; m <= 12; ++m) {
      std::complex<double> wave = 0;
      for (std::size_t i = 0; i < u.size(); ++i)
        wave += u[i] * std::polar(1.0, -2 * std::numbers::pi * m * static_cast<double>(i) / 24) / 24.0;
      if (m >= 8) EXPECT_LT(std::abs(wave), 1e-15) << time << " " << m;
      if (m > 0 && m < 8) EXPECT_GT(std::abs(wave), 1e-9) << time << " " << m;
    }
  }
}

TEST(Spectral, SinglePrecisionIsThatOfTheFields) {
  const double error = run_scene(burgers_on_ring, "line", {{"real", "f32"}}).l2.at("u");
  EXPECT_LT(error, 1e-5);
  EXPECT_GT(error, 1e-9);
}

}  // namespace
}  // namespace dpde
