// SPDX-License-Identifier: Apache-2.0
// Poisson brackets of A. Arakawa, J. Comput. Phys. 1 (1966) 119, and the drift waves of A. Hasegawa and M. Wakatani,
// Phys. Rev. Lett. 50 (1983) 682, against runs of another code (HW2D) and growth rates of the linear equations.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "../driver/driver_support.h"
#include "support/opened_scene.h"

namespace dpde::testing {
namespace {

using std::numbers::pi;

/// The observables of a scene at its end, and the first value of a state.
std::map<std::string, double> observed(const std::string& text, const Overrides& overrides,
                                       const std::string& state = "omega") {
  const OpenedScene scene(text, "s", {overrides});
  if (scene.session == nullptr) return {};
  Rollout& rollout = scene.session->rollout();
  rollout.run();
  std::map<std::string, double> result;
  for (const auto& [name, value] : scene.session->observe(scene.session->end_time(), rollout.final_states()))
    result[name] = value;
  std::vector<double> values(scene.session->workspace().cell_count());
  copy_out(scene.session->workspace().layout(),
           rollout.final_states()[static_cast<std::size_t>(rollout.state_index(state))], values);
  result["first of " + state] = values.front();
  return result;
}

/// dt(u) = [a, u], one forward Euler step of length 1: the change of u is the bracket.
std::string one_step(int nx, int ny, int order, const std::string& a, const std::string& u) {
  return fmt::format(
      "model m {{ field u; coefficient a; dt(u) = bracket(a, u) }}\nscheme s {{ time = euler; dx = central({}) }}\n"
      "scene s : m with s {{\n  grid x = 0 .. 1, cells {}, periodic\n  grid y = 0 .. 2, cells {}, periodic\n  a = {}\n"
      "  initial u = {}\n  time 0 .. 1, step 1\n}}\n",
      order, nx, ny, a, u);
}

/// Equation 46, written out: (J++ + J+x + Jx+)/3 of differences over twice the spacings.
TEST(Bracket, IsArakawasOfNinePoints) {
  constexpr int nx = 7, ny = 5;
  constexpr double hx = 1.0 / nx, hy = 2.0 / ny;
  const std::string a_text = "sin(2*pi*x + 1)*cos(pi*y) + 0.3*cos(6*pi*x - 2*pi*y)",
                    u_text = "cos(2*pi*x)*sin(2*pi*y + 0.4) + 0.2*sin(4*pi*x)";
  const auto a = [&](int i, int j) {
    const double x = (i + 0.5) * hx, y = (j + 0.5) * hy;
    return std::sin(2 * pi * x + 1) * std::cos(pi * y) + 0.3 * std::cos(6 * pi * x - 2 * pi * y);
  };
  const auto u = [&](int i, int j) {
    const double x = (i + 0.5) * hx, y = (j + 0.5) * hy;
    return std::cos(2 * pi * x) * std::sin(2 * pi * y + 0.4) + 0.2 * std::sin(4 * pi * x);
  };
  const std::vector<double> found = run_scene(one_step(nx, ny, 2, a_text, u_text), "s").state.at("u");
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const double plus = (a(i + 1, j) - a(i - 1, j)) * (u(i, j + 1) - u(i, j - 1)) -
                          (a(i, j + 1) - a(i, j - 1)) * (u(i + 1, j) - u(i - 1, j));
      const double cross =
          a(i + 1, j) * (u(i + 1, j + 1) - u(i + 1, j - 1)) - a(i - 1, j) * (u(i - 1, j + 1) - u(i - 1, j - 1)) -
          a(i, j + 1) * (u(i + 1, j + 1) - u(i - 1, j + 1)) + a(i, j - 1) * (u(i + 1, j - 1) - u(i - 1, j - 1));
      const double turned =
          u(i, j + 1) * (a(i + 1, j + 1) - a(i - 1, j + 1)) - u(i, j - 1) * (a(i + 1, j - 1) - a(i - 1, j - 1)) -
          u(i + 1, j) * (a(i + 1, j + 1) - a(i + 1, j - 1)) + u(i - 1, j) * (a(i - 1, j + 1) - a(i - 1, j - 1));
      const double bracket = (plus + cross + turned) / (3 * 4 * hx * hy);
      EXPECT_NEAR(found[static_cast<std::size_t>(j * nx + i)], u(i, j) + bracket, 1e-12 * std::abs(bracket) + 1e-12);
    }
  }
}

TEST(Bracket, HasTheOrderOfItsDifferences) {
  const auto error = [](int cells, int order) {
    const std::vector<double> found =
        run_scene(one_step(cells, cells, order, "sin(2*pi*x)*cos(pi*y)", "cos(2*pi*x)*sin(2*pi*y)"), "s").state.at("u");
    double sum = 0;
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        const double x = (i + 0.5) / cells, y = 2 * (j + 0.5) / cells;
        const double a_x = 2 * pi * std::cos(2 * pi * x) * std::cos(pi * y),
                     a_y = -pi * std::sin(2 * pi * x) * std::sin(pi * y),
                     u_x = -2 * pi * std::sin(2 * pi * x) * std::sin(2 * pi * y),
                     u_y = 2 * pi * std::cos(2 * pi * x) * std::cos(2 * pi * y);
        const double exact = std::cos(2 * pi * x) * std::sin(2 * pi * y) + a_x * u_y - a_y * u_x;
        sum += std::pow(found[static_cast<std::size_t>(j * cells + i)] - exact, 2);
      }
    }
    return std::sqrt(sum) / cells;
  };
  for (const int order : {2, 4, 6}) EXPECT_NEAR(std::log2(error(24, order) / error(48, order)), order, 0.15) << order;
}

/// The other code's points are at the corners of cells: coordinates are shifted by half a cell.
std::string flow_text(const std::string& model, const std::string& rest) {
  std::string text = model +
                     "scheme s { time = rk4; dx = central(2); lap = spectral }\nscene s : m with s {\n"
                     "  grid x = 0 .. 2*pi/0.15, cells 64, periodic\n  grid y = 0 .. 2*pi/0.15, cells 64, periodic\n"
                     "  initial omega = cos(4*Y + 0.5)*sin(3*X) + 0.5*sin(8*Y)*cos(2*X + 0.2)\n" +
                     rest + "}\n";
  for (const char* axis : {"X", "Y"}) {
    const std::string shifted = fmt::format("(0.15*{} - pi/64)", axis[0] == 'X' ? "x" : "y");
    for (std::size_t at = text.find(axis); at != std::string::npos; at = text.find(axis, at + shifted.size()))
      text.replace(at, 1, shifted);
  }
  return text;
}

/// Published for the other code: relative drifts of energy and enstrophy over t = 5, with Runge-Kutta steps.
TEST(Bracket, KeepsEnergyAndEnstrophy) {
  const std::string text = flow_text(
      "model m { field omega; solve lap(phi) = omega for phi; dt(omega) = -bracket(phi, omega) }\n",
      "  observe energy = -0.5*mean(phi*omega)\n  observe enstrophy = 0.5*mean(omega^2)\n"
      "  observe of_phi = mean(phi*bracket(phi, omega))\n  observe of_omega = mean(omega*bracket(phi, omega))\n"
      "  time 0 .. 5, step 0.05\n");
  struct Case {
    const char* step;
    double energy, enstrophy;
  };
  for (const Case& c : {Case{"0.05", -1.3e-11, -3.3e-11}, {"0.025", -6.7e-13, -1.3e-12}}) {
    const auto run = observed(text, {{"step", c.step}});
    const double energy = run.at("energy") / 0.2426470588235294 - 1, enstrophy = run.at("enstrophy") / 0.15625 - 1;
    EXPECT_NEAR(energy / c.energy, 1, 0.1) << c.step;
    EXPECT_NEAR(enstrophy / c.enstrophy, 1, 0.1) << c.step;
    EXPECT_LT(std::abs(run.at("of_phi")), 1e-17);
    EXPECT_LT(std::abs(run.at("of_omega")), 1e-17);
    EXPECT_NEAR(run.at("first of omega"), 0.463606180, 5e-9);
  }
}

/// With Fourier series the time derivatives of both are 0, with and without aliased waves; without them steps are
/// longer.
TEST(Bracket, KeepsEnergyAndEnstrophyByFourierSeries) {
  std::string text = flow_text(
      "model m { field omega; solve lap(phi) = omega for phi; dt(omega) = -bracket(phi, omega) }\n",
      "  observe energy = -0.5*mean(phi*omega)\n  observe enstrophy = 0.5*mean(omega^2)\n"
      "  observe of_phi = mean(phi*bracket(phi, omega))\n  observe of_omega = mean(omega*bracket(phi, omega))\n"
      "  time 0 .. 5, step 0.05\n");
  const std::string differences = "central(2)";
  text.replace(text.find(differences), differences.size(), "spectral");
  for (const auto& [dealias, step] : {std::pair{"two_thirds", "0.05"}, {"none", "0.025"}}) {
    const auto run = observed(text, {{"step", step}, {"dealias", dealias}});
    EXPECT_NEAR(run.at("energy") / 0.2426470588235294, 1, 5e-10) << dealias;
    EXPECT_NEAR(run.at("enstrophy") / 0.15625, 1, 5e-10) << dealias;
    EXPECT_LT(std::abs(run.at("of_phi")), 1e-16) << dealias;
    EXPECT_LT(std::abs(run.at("of_omega")), 1e-16) << dealias;
  }
}

const std::string drift_waves =
    "function fall(f) = dx(dx(f)) + dy(dy(f))\n"
    "model m {\n  field n, omega\n  param c\n  solve lap(phi) = omega for phi\n"
    "  dt(n) = c*(phi - n) - bracket(phi, n) - dy(phi) + 5e-8*fall(fall(fall(n)))\n"
    "  dt(omega) = c*(phi - n) - bracket(phi, omega) + 5e-8*fall(fall(fall(omega)))\n}\n";

/// The other code's own run (float64, 64 x 64 cells, steps of 0.025).
TEST(DriftWaves, AreThoseOfTheOtherCode) {
  const std::string text = flow_text(
      drift_waves,
      "  c = 1\n  initial n = sin(3*Y)*cos(2*X) + 0.5*sin(9*Y + 1)*cos(X) + 0.25*cos(5*Y + 0.3)*sin(4*X + 0.7)\n"
      "  observe flux = -mean(n*dy(phi))\n  observe resistive = mean((n - phi)^2)\n"
      "  observe energy = 0.5*mean(n^2 + dx(phi)^2 + dy(phi)^2)\n  observe enstrophy = 0.5*mean((n - omega)^2)\n"
      "  time 0 .. 1, step 0.025\n");
  const std::map<std::string, double> at_1{{"flux", 3.9841917219e-2},
                                           {"resistive", 2.3297713261e-2},
                                           {"energy", 2.2725020098e-1},
                                           {"enstrophy", 3.5814540056e-1}};
  const std::map<std::string, double> at_5{{"flux", 5.2216714199e-2},
                                           {"resistive", 2.3160521711e-2},
                                           {"energy", 3.1982747592e-1},
                                           {"enstrophy", 5.2926351858e-1}};
  for (const auto& [end, wanted] : {std::pair{"1", at_1}, {"5", at_5}}) {
    const auto run = observed(text, {{"end", end}});
    for (const auto& [name, value] : wanted)
      EXPECT_NEAR(run.at(name) / value, 1, end[0] == '1' ? 1e-10 : 5e-9) << name << " " << end;
  }
}

/// Waves along y grow by the larger root s of s^2 + s (c (1 + 1/k^2) + 2 d) + ... of the linear equations; with
/// differences of second order dy is i sin(k h)/h.
TEST(DriftWaves, GrowAsTheLinearEquationsSay) {
  using Complex = std::complex<double>;
  const double k = 7 * 0.15, h = 2 * pi / 0.15 / 64;
  for (const double c : {0.5, 1.0, 2.0}) {
    const double drift = std::sin(k * h) / h, damping = -5e-8 * std::pow(4 * std::pow(std::sin(k * h / 2) / h, 2), 3);
    // (n, omega), phi = -omega/k^2: n' = -(c n) + (c - i drift) phi + damping n, omega' = c (phi - n) + damping omega.
    const Complex b = -(c - Complex(0, drift)) / (k * k), e = -c / (k * k);
    const Complex trace = -c + e, determinant = -c * e - b * -c;
    const Complex growth = 0.5 * (trace + std::sqrt(trace * trace - 4.0 * determinant)) + damping;
    const double other = (0.5 * (trace - std::sqrt(trace * trace - 4.0 * determinant)) + damping).real();
    const double fastest = std::max(growth.real(), other);
    const std::string text = fmt::format(
        "{}scheme s {{ time = rk4; dx = central(2); lap = spectral }}\nscene s : m with s {{\n  c = {}\n"
        "  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 2*pi/0.15, cells 64, periodic\n"
        "  initial n = 1e-6*sin(1.05*y)\n  initial omega = 1e-6*cos(1.05*y)\n  observe size = mean(n^2)\n"
        "  time 0 .. 100, step 0.025\n}}\n",
        drift_waves, c);
    const auto size = [&](const char* end) { return observed(text, {{"end", end}}).at("size"); };
    EXPECT_NEAR(0.5 * std::log(size("100") / size("60")) / 40 / fastest, 1, 1e-3) << c;
  }
}

/// Also on grids of few cells, periodic and between walls.
TEST(Bracket, HasExactDerivatives) {
  for (const char* walls : {", periodic", ""}) {
    const std::string text = fmt::format(
        "model m {{ field a, b; param nu; dt(a) = bracket(b, a) + nu*lap(a); dt(b) = bracket(a, b^2) + nu*lap(b) }}\n"
        "scheme s {{ time = rk2; dx = central(2) }}\nscene s : m with s {{\n  nu = 0.01\n"
        "  grid x = 0 .. 1, cells 6, periodic\n  grid y = 0 .. 1, cells 5{}\n{}"
        "  initial a = sin(2*pi*x) + y\n  initial b = cos(2*pi*x)*y\n  time 0 .. 0.02, step 0.01\n}}\n"
        "task t : s {{\n  unknown nu\n  unknown initial a\n  unknown initial b\n  minimise mean(a^2*b + b^3)\n}}\n",
        walls, *walls != 0 ? "" : "  boundary a: y.low = 0, y.high = 1\n  boundary b = zero_gradient\n");
    expect_certified(text, true);
  }
}

}  // namespace
}  // namespace dpde::testing
