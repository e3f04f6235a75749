// SPDX-License-Identifier: Apache-2.0
// Limits with physical growth, and of steps whose coefficients change between intervals of time.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/trial.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

double root(const std::function<double(double)>& f, double low, double high) {
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) > 0 ? high : low) = middle;
  }
  return low;
}

/// Implicit steps have poles: their factors are 1/(1 - z) and (1 + z/2)/(1 - z/2), that of the equation is exp(z).
/// Growth above exp(2 z) is attributed to the step.
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
    const StabilityReport verdict = verdict_of(*open_scene(
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
  const StabilityReport verdict = verdict_of(
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

/// The limit is that of all intervals, not of the first alone: RK4 and F lap(u) with F up to 0.21.
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
    const StabilityReport verdict = verdict_of(*open_scene(
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

/// u knows nothing of a, which grows by exp(50 t): central differences and Euler's method make it grow at every step,
/// by waves, by the grid's own matrix and between walls. A run in which u is disturbed grows by what is said.
TEST(Growing, OfOneFieldExcusesNothingInAnother) {
  const auto scene = [](const std::string& speed, int cells, const std::string& sides) {
    return open_scene(
        fmt::format("model m {{ field u, a; coefficient c; dt(u) = -c*dx(u); dt(a) = 50*a + 0.001*lap(a) }}"
                    "\nscheme e {{ time = euler }}\nscene s : m with e {{\n  grid x = 0 .. 1, cells {}{}\n"
                    "  c = {}\n  initial u = sin(2*pi*x)\n  initial a = cos(2*pi*x)\n"
                    "  time 0 .. 2, step 1/250\n}}\n",
                    cells, sides, speed));
  };
  const std::string ring = ", periodic", walls = "\n  boundary u: x = 0\n  boundary a: x = zero_gradient";
  for (const auto& session : {scene("1", 64, ring), scene("1 + 0.5*sin(2*pi*x)", 64, ring),
                              scene("1 + 0.5*sin(2*pi*x)", 192, ring), scene("1", 192, walls)}) {
    const StabilityReport verdict = verdict_of(*session);
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never);
    EXPECT_EQ(verdict.field, "u");
    EXPECT_EQ(verdict.group, StateGroup{"u"});
    EXPECT_NEAR(verdict.growth_rate, 50, 1e-6);
    EXPECT_EQ(verdict.group_growth_rate, 0);
    EXPECT_TRUE(verdict.ruins_run());
    EXPECT_FALSE(grows_nothing(*session));
  }
  const auto session = scene("1 + 0.5*sin(2*pi*x)", 64, ring);
  const Trial trial = try_step(*session, 0.004, {.steps = 500, .group = {"u"}}).value();
  EXPECT_FALSE(trial.is_stable);
  EXPECT_NEAR(std::log(trial.growth), std::log(verdict_of(*session).growth), 0.05 * std::log(trial.growth));
}

/// A pressure that is solved for anew in each step does not depend on its old value: a group with factor 0.
TEST(Growing, NothingGrowsOfWhatForgetsAll) {
  const auto session = open_scene(
      "model m { vector u on faces; field p; dt(u) = -grad(p) + 0.01*lap(u); 0 = div(u) gives p }\n"
      "scheme e { time = euler }\nscene s : m with e {\n  grid x = 0 .. 1, cells 8, periodic\n"
      "  grid y = 0 .. 1, cells 8, periodic\n  initial u = (sin(2*pi*y), 0)\n  time 0 .. 1, step 0.01\n}\n");
  EXPECT_TRUE(grows_nothing(*session));
  EXPECT_FALSE(verdict_of(*session).is_above());
}

/// Euler's method and a damped oscillation: |1 + (-c/2 + i w) dt|^2 = 1 - c dt + w^2 dt^2, up to dt = c/w^2 = 0.008.
/// Heat as a second group has another limit, 1/96 on 8 cells, and grows faster above both.
TEST(Growing, TheLowestLimitOfAllFieldsIsTold) {
  for (const char* step : {"0.004", "0.0104", "0.0112", "0.02"}) {
    const StabilityReport verdict = verdict_of(*open_scene(
        fmt::format("model m {{ field u, v, a; dt(u) = v; dt(v) = -1.5625*u - 0.0125*v; dt(a) = 0.75*lap(a) }}"
                    "\nscheme e {{ time = euler }}\nscene s : m with e {{\n  grid x = 0 .. 1, cells 8, "
                    "periodic\n  initial u = 1\n  initial v = 0\n  initial a = sin(2*pi*x)\n"
                    "  time 0 .. 1000*{0}, step {0}\n}}\n",
                    step)));
    EXPECT_NEAR(verdict.limit.step, 0.008, 1e-5) << step;
    EXPECT_EQ(verdict.group, (StateGroup{"u", "v"}));
    const double a = std::max(0.0, std::log(std::abs(1 - 0.75 * 4 * 64 * std::stod(step)))),
                 w = 1.5625 * std::stod(step);
    const double of_u = 0.5 * std::log(1 + (w - 0.0125) * std::stod(step));
    const double grown = 1000 * std::max({a, of_u, 0.0});
    EXPECT_NEAR(std::max(verdict.dominant().end_growth, 0.0), grown, 1e-3 * grown + 1e-9) << step;
  }
}

/// u is a coefficient to T, which does not act on it: in all stages it counts as it is at the step's start. The factor
/// of the explicit half of ARS(4,4,3) is that of U. M. Ascher, S. J. Ruuth and R. J. Spiteri, Appl. Numer. Math. 25
/// (1997), section 2.8.
TEST(Growing, StatesOfOtherGroupsAreFrozenAsCoefficientsAre) {
  const StepLimit limit =
      verdict_of(
          *open_scene("model m { field u, T; dt(u) = 0.05*lap(u); dt(T) = u*lap(T) }\nscheme e { time = ars443 }\n"
                      "scene s : m with e {\n  grid x = 0 .. 1, cells 64, periodic\n  initial u = 1\n"
                      "  initial T = cos(2*pi*x)\n  time 0 .. 0.5, step 1/500\n}\n"))
          .limit;
  const auto factor = [](double z) {
    const double y2 = 1 + z / 2, y3 = 1 + z * (11.0 / 18 + y2 / 18), y4 = 1 + z * (5 - 5 * y2 + 3 * y3) / 6;
    return 1 + z * (1 + 7 * y2 + 3 * y3 - 7 * y4) / 4;
  };
  const double exact = root([&](double z) { return std::abs(factor(-z)) - 1; }, 1, 4) / (4 * 64 * 64);
  EXPECT_NEAR(limit.step, exact, 1e-3 * exact);
}

/// About the solution 1 of Schroedinger's cubic equation waves below sqrt(2) grow: a ring of 2*pi has none of them, and
/// on it what steps of second order let grow is their own. On a longer ring waves that do not grow by right may do so
/// no faster than the fastest, 1.
TEST(Growing, IsThatOfWavesThatARingHas) {
  const auto limit = [](const std::string& length, int cells) {
    return verdict_of(
               *open_scene(
                   "model m { field a, b; dt(a) = -lap(b) - b; dt(b) = lap(a) + 3*a }\nscheme e { lap = spectral; "
                   "time = rk2 }\nscene s : m with e {\n  grid x = 0 .. " +
                   fmt::format("{}, cells {}", length, cells) +
                   ", periodic\n  initial a = 0\n  initial b = 0\n  time 0 .. 5, step 1e-4\n}\n"))
        .limit;
  };
  for (const int cells : {32, 64, 128}) EXPECT_EQ(limit("2*pi", cells).kind, StepLimit::Kind::never) << cells;
  const StepLimit longer = limit("20*pi", 160);
  ASSERT_EQ(longer.kind, StepLimit::Kind::limit);
  const double w = std::sqrt((64.0 - 1) * (64 - 3));  // of the wave of two cells: |g|^2 = 1 + (w dt)^4/4
  const double exact = root([&](double dt) { return 0.5 * std::log1p(std::pow(w * dt, 4) / 4) - dt; }, 1e-5, 0.1);
  EXPECT_NEAR(longer.step, exact, 0.02 * exact);
}

/// An event after the last step does not couple fields in the steps.
TEST(Growing, RareEventsTieNoFields) {
  const StabilityReport verdict = verdict_of(*open_scene(
      "model m { field u, a; dt(u) = -dx(u); dt(a) = 50*a }\nscheme e { time = euler }\nscene s : m with e {\n"
      "  grid x = 0 .. 1, cells 64, periodic\n  initial u = sin(2*pi*x)\n  initial a = 1\n  time 0 .. 2, step 1/250\n"
      "  at t = 2: u = u + 1e-30*a, a = a + 1e-30*u\n}\n"));
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never);
}

/// By Fourier series, where the mean grows by exp(t) and waves of number k have the rates z of
/// (z - 1 + d)*(z + d) = k^2, d = 0.02 k^2: those that decay may not grow by AB2, g^2 = g + (3 g - 1)*z*dt/2.
TEST(Growing, DecayingWavesHaveNoShareInItWhateverTheMemory) {
  const auto limit =
      verdict_of(*open_scene("model m { field u, v; dt(u) = u + 0.02*lap(u) - dx(v); dt(v) = 0.02*lap(v) - dx(u) }\n"
                             "scheme a { time = ab2; dx = spectral; lap = spectral }\nscene s : m with a {\n"
                             "  grid x = 0 .. 2*pi, cells 32, periodic\n  initial u = 0\n  initial v = 0\n"
                             "  time 0 .. 10, step 0.05\n}\n"))
          .limit;
  ASSERT_EQ(limit.kind, StepLimit::Kind::limit);
  const auto excess = [](double dt) {
    double worst = -1;
    for (int k = 0; k <= 16; ++k) {
      const std::complex<double> half = std::sqrt(std::complex<double>(0.25 - (k < 16 ? k * k : 0)));
      for (const std::complex<double> z : {0.5 - 0.02 * k * k + half, 0.5 - 0.02 * k * k - half}) {
        const std::complex<double> p = 1.0 + 1.5 * z * dt, root_of = std::sqrt(p * p - 2.0 * z * dt);
        const double g = std::log(std::max(std::abs(p + root_of), std::abs(p - root_of)) / 2);
        worst = std::max(worst, g - (z.real() < -0.1 ? 0 : 2 * dt));
      }
    }
    return worst;
  };
  EXPECT_NEAR(limit.step, root(excess, 0.01, 0.2), 1e-3 * limit.step);
}

/// What flows from u to a alone leaves them apart; there and back they are one.
TEST(Growing, IsThatOfFieldsThatDependOnOneAnother) {
  const auto group = [](const std::string& of_u) {
    return verdict_of(*open_scene("model m { field u, a, b; dt(u) = lap(u)" + of_u +
                                  "; dt(a) = u - a; dt(b) = a*b }\nscheme e { time = ab2 }\nscene s : m with e {\n"
                                  "  grid x = 0 .. 1, cells 300, periodic\n  initial u = sin(2*pi*x)\n  initial a = 1\n"
                                  "  initial b = 1\n  time 0 .. 1, step 1e-6\n}\n"))
        .group;
  };
  EXPECT_EQ(group("").size(), 2) << "with the rate before";
  EXPECT_EQ(group(" - 3*a").size(), 4);
  EXPECT_EQ(group(" - b").size(), 0) << "all";
}

/// The factor of ETDRK4 for u' = L u + N u (S. M. Cox and P. C. Matthews, J. Comput. Phys. 176 (2002), eq. 26 to 29),
/// with coefficients as means over a circle (A.-K. Kassam and L. N. Trefethen, SIAM J. Sci. Comput. 26 (2005)).
std::complex<double> factor_of_etdrk4(double l, std::complex<double> n, double h) {
  using Complex = std::complex<double>;
  constexpr int count = 64;
  Complex q = 0, f1 = 0, f2 = 0, f3 = 0;
  for (int k = 0; k < count; ++k) {
    const Complex z = l * h + std::polar(1.0, 2 * std::numbers::pi * (k + 0.5) / count), e = std::exp(z);
    q += (std::exp(z / 2.0) - 1.0) / z;
    f1 += (-4.0 - z + e * (4.0 - 3.0 * z + z * z)) / (z * z * z);
    f2 += (2.0 + z + e * (-2.0 + z)) / (z * z * z);
    f3 += (-4.0 - 3.0 * z - z * z + e * (4.0 - z)) / (z * z * z);
  }
  for (Complex* mean : {&q, &f1, &f2, &f3}) *mean *= h / count;
  const Complex e = std::exp(l * h), half = std::exp(l * h / 2), a = half + q * n, b = half + q * n * a,
                c = half * a + q * n * (2.0 * b - 1.0);
  return e + f1 * n + 2.0 * f2 * n * (a + b) + f3 * n * c;
}

/// Kuramoto and Sivashinsky's equation about u = 0.2 on a torus, by waves of whole numbers: those that decay by right
/// may not grow, others no more than twice as fast as the fastest. It is the same whatever the scene's own step is.
TEST(Growing, LimitsOfExponentialStepsAreThoseOfTheirWaves) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const auto limit = [](const std::string& step) {
    return verdict_of(
               *open_scene("model m { field u; dt(u) = -advect((u, u), u) - lap(u) - lap(lap(u)) }\n"
                           "scheme e { advect = spectral; dx = spectral; lap = spectral; time = etdrk4 }\n"
                           "scene s : m with e {\n  grid x = 0 .. 12*pi, cells 32, periodic\n"
                           "  grid y = 0 .. 12*pi, cells 32, periodic\n  initial u = 0.2\n  time 0 .. 20, step " +
                           step + "\n}\n"))
        .limit.step;
  };
  const double found = limit("1");
  if (testing::is_thorough()) EXPECT_NEAR(limit("0.02"), found, 1e-4 * found);
  const auto excess = [](double step) {
    double worst = -1;
    for (int i = -15; i <= 15; ++i) {
      for (int j = -15; j <= 15; ++j) {
        const double x = i / 6.0, y = j / 6.0, k2 = x * x + y * y, rate = k2 - k2 * k2;
        const double growth = std::log(std::abs(factor_of_etdrk4(rate, {0, -0.2 * (x + y)}, step)));
        worst = std::max(worst, growth - (rate < -0.1 * 0.25 ? 0 : 2 * 0.25 * step));
      }
    }
    return worst;
  };
  const double exact = root(excess, 5, 15);
  EXPECT_NEAR(found, exact, 1e-4 * exact);
}

}  // namespace
}  // namespace dpde::stability
