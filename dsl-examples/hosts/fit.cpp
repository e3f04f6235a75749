// SPDX-License-Identifier: Apache-2.0
// A host that solves an inverse problem and asks how sure the answer is: the task `recover` of ../heat/heat.dpde, ahead
// of time with SECOND_ORDER. Data are made for a known conductivity; the Hessian there is known, too, as each step
// scales sin(m x) by g_m = 1 - 4 kappa dt/h^2 sin(m h/2)^2.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "fit_rod.h"

constexpr double truth = 0.12, steps = 128, cells = 128, dt = 1 / steps, h = 2 * std::numbers::pi / cells;

double slope(int m) { return -4 * dt / (h * h) * std::pow(std::sin(m * h / 2), 2); }  // of g_m in kappa
double g(int m) { return 1 + truth * slope(m); }

int main() {
  try {
    fit_rod sim;
    std::vector<double> data = sim.coordinates(0);
    for (double& x : data) x = std::pow(g(1), steps) * std::sin(x) + 0.5 * std::pow(g(3), steps) * std::sin(3 * x);
    sim.set_u_ref(data);

    // The task's own optimiser; false would stop it, here and in the middle of a gradient.
    sim.watch_gradients([](const dpde::GradientProgress& p) { return p.done <= p.total; });
    const dpde::Optimised found = sim.optimise([](const dpde::OptimiserProgress& p) {
      std::printf("%2d  loss %.3e  gradient %.3e\n", p.iteration, p.loss, p.gradient_norm);
      return true;
    });
    const double kappa = sim.value_of("kappa")[0];
    std::printf("kappa = %.9g after %d iterations: %s\n", kappa, found.iterations, describe(found.reason).c_str());

    // Where the data are met the Hessian is that of Gauss and Newton: the squares of what the data change with kappa.
    const double one = 1;
    const double hessian = sim.hessian_vector({&one, 1})[0];
    const double squares = sim.hessian_vector({&one, 1}, dpde::Curvature::gauss_newton)[0];
    const auto change = [](int m) { return steps * std::pow(g(m), steps - 1) * slope(m); };
    const double exact = std::pow(change(1), 2) + std::pow(0.5 * change(3), 2);
    std::printf("Hessian %.9g, Gauss-Newton %.9g, exactly %.9g\n", hessian, squares, exact);
    std::printf("an error of 0.001 in the data is one of %.2g in kappa\n", 0.001 * std::sqrt(2 / hessian));
    const auto close = [](double a, double b, double tolerance) { return std::abs(a - b) <= tolerance * std::abs(b); };
    return close(kappa, truth, 1e-7) && close(hessian, exact, 1e-5) && close(squares, exact, 1e-5) ? 0 : 1;
  } catch (const dpde::Error& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
    return 2;
  }
}
