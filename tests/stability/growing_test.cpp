// SPDX-License-Identifier: Apache-2.0
// Limits beside growth that is the equations' own, and of steps whose coefficients change between intervals of time.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "stability/stability_support.h"
#include "stability/verdict.h"

namespace dpde::stability {
namespace {

double root(const std::function<double(double)>& f, double low, double high) {
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) > 0 ? high : low) = middle;
  }
  return low;
}

/// What is solved for has a pole: a step multiplies by 1/(1 - z) and (1 + z/2)/(1 - z/2) where the equation does by
/// exp(z). More than exp(2 z) is the step's.
TEST(Growing, ImplicitStepsNearTheirPolesAreTooLong) {
  const auto limit = [](const std::string& time) {
    return verdict_of(*open_scene("model m { field u; dt(u) = 0.1*lap(u) + 5*u }\nscheme c { time = " + time +
                                  "; implicit = all }\nscene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n"
                                  "  initial u = 1\n  time 0 .. 1, step 0.01\n}\n"))
        .limit;
  };
  const double backward = root([](double z) { return -std::log(1 - z) - 2 * z; }, 0.5, 0.9999);
  EXPECT_NEAR(limit("backward_euler").step, backward / 5, 2e-3 * backward / 5);
  const double middle = root([](double z) { return std::log((1 + z / 2) / (1 - z / 2)) - 2 * z; }, 1.5, 1.9999);
  EXPECT_NEAR(limit("crank_nicolson").step, middle / 5, 2e-3 * middle / 5);
}

/// b decays, a grows by exp(4 t): b's limit is that of a decay by 18 + 4*0.001/h^2 with RK4.
TEST(Growing, HidesNoLimitOfWhatDecays) {
  for (const int cells : {16, 300}) {
    const double fastest = 18 + 4e-3 * 16 * 16;
    const Verdict verdict = verdict_of(*open_scene(
        fmt::format("model m {{ field a, b; dt(a) = 4*a + 0.001*lap(a); dt(b) = -18*b + 0.001*lap(b) + a }}\n"
                    "scheme c {{ time = rk4 }}\nscene s : m with c {{\n  grid x = 0 .. {}/16, cells {}, periodic\n"
                    "  initial a = 1\n  initial b = 1\n  time 0 .. 1, step 0.01\n}}\n",
                    cells, cells)));
    EXPECT_NEAR(verdict.growth_rate, 4, 1e-6);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(verdict.limit.step * fastest, 2.785293563, 3e-3) << cells;
  }
}

/// By Fourier series short waves grow as the equations let them, here that of 4 cells by solves in the step, a
/// mode of an ocean of two layers: its growth is no fault of the steps.
TEST(Growing, OfShortWavesIsTheEquationsWhereTheyAreFourierSeries) {
  const Verdict verdict = verdict_of(
      *open_scene("model m { field q, r; solve lap(p) = q + r for p; solve lap(s) - 5*s = q - r for s\n"
                  "  dt(q) = -dx(q) - 5*dx((p + s)/2); dt(r) = dx(r) + 5*dx((p - s)/2) }\n"
                  "scheme c { dx = spectral; lap = spectral; dealias = two_thirds; time = rk4 }\nscene s : m with c {\n"
                  "  grid x = 0 .. 2*pi*2.5, cells 12, periodic\n  initial q = sin(x)\n  initial r = cos(x)\n"
                  "  time 0 .. 10, step 0.02\n}\n"));
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_FALSE(verdict.is_above());
  const double k = 3 / 2.5;
  EXPECT_NEAR(verdict.growth_rate, k * std::sqrt((5 - k * k) / (5 + k * k)), 1e-2);
}

/// Of all intervals, not the first alone: RK4 and F lap(u) with F up to 0.21.
TEST(Growing, ControlFieldsAreLookedAtInAllIntervals) {
  const auto limit = [](const std::string& f) {
    return verdict_of(*open_scene("model m { field u; control field F; dt(u) = F*lap(u) }\nscheme c { time = rk4 }\n"
                                  "scene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n  F = " +
                                  f + " every 0.5\n  initial u = noise(1)\n  time 0 .. 20, step 0.02\n}\n"))
        .limit.step;
  };
  EXPECT_NEAR(limit("0.01 + if(t > 2, 0.2, 0)") * 0.21 * 4 * 256, 2.785293563, 3e-3);
  EXPECT_NEAR(limit("0.01 + if(t > 2 and t < 2.4, 0.3*sin(pi*x)^8, 0)") * 0.31 * 4 * 256, 2.785293563, 0.3);
}

/// A leapfrog of second order as a program: changes of a step go as its square, however short the scene's is.
TEST(Growing, ProgramsOfSecondOrderHaveALimitForShortStepsToo) {
  for (const char* step : {"1e-5", "1e-4", "0.05"}) {
    const Verdict verdict = verdict_of(*open_scene(
        fmt::format("kernel k1(u: field halo 1, o: field, out v: field, c, hx, dt: param) {{ v = 2*u - o + "
                    "dt^2*c^2*(u[+1]-2*u+u[-1])/hx^2 }}\nkernel kp(u: field, out w: field) {{ w = u }}\n"
                    "program p {{ fill u x periodic; run k1; run kp; swap o, w; swap u, v }}\n"
                    "scene s : p {{\n  grid x = 0 .. 1, cells 9, periodic\n  c = 0.456\n  initial u = noise(1)\n"
                    "  initial o = noise(2)\n  time 0 .. 1, step {}\n}}\n",
                    step)));
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << step;
    EXPECT_NEAR(verdict.limit.step * 0.456 * 9 * std::sin(4 * std::numbers::pi / 9), 1, 1e-3) << step;
  }
}

}  // namespace
}  // namespace dpde::stability
