// SPDX-License-Identifier: Apache-2.0
// A host without the compiler: the task `conductivity` of ../heat/heat.dpde as a class, made by dpde_add_library. Each
// step scales sin(m x) by g_m = 1 - 4 kappa dt/h^2 sin(m h/2)^2, so that run, loss and gradient are known exactly.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "conductivity.h"

constexpr double kappa = 0.12, steps = 128, cells = 128, dt = 1 / steps, h = 2 * std::numbers::pi / cells;

double slope(int m) { return -4 * dt / (h * h) * std::pow(std::sin(m * h / 2), 2); }  // of g_m in kappa
double g(int m) { return 1 + kappa * slope(m); }

bool close(const char* what, double value, double exact) {
  std::printf("%-16s %.15g, exactly %.15g\n", what, value, exact);
  return std::abs(value - exact) <= 1e-12 * std::abs(exact);
}

int main() {
  try {
    conductivity sim({.slots = 4});  // the gradient keeps four states and computes the others again
    sim.set_kappa(kappa);
    sim.run();
    std::vector<double> u(sim.size());
    sim.get_u(u);
    const double x = sim.coordinates(0)[10], a = std::pow(g(1), steps), b = 0.5 * std::pow(g(3), steps);
    bool good = close("u in a cell", u[10], a * std::sin(x) + b * std::sin(3 * x));

    // loss = 0.5*integral(u^2) at the end = pi/2*(a^2 + b^2)
    good &= close("loss", sim.gradient(), std::numbers::pi / 2 * (a * a + b * b));
    good &= close("d loss / d kappa", sim.kappa_bar(),
                  std::numbers::pi * steps * (a * a * slope(1) / g(1) + b * b * slope(3) / g(3)));
    good &= close("d loss / d u0", sim.u_bar()[10],
                  h * (std::pow(g(1), 2 * steps) * std::sin(x) + 0.5 * std::pow(g(3), 2 * steps) * std::sin(3 * x)));

    std::ranges::fill(u, 3.0);
    sim.set_u(u);  // a uniform rod stays as it is
    sim.step(10);
    sim.get_u(u);
    good &= close("uniform rod", u[0], 3);
    return good ? 0 : 1;
  } catch (const dpde::Error& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 2;
  }
}
