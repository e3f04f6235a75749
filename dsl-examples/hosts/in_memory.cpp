// SPDX-License-Identifier: Apache-2.0
// A host with the compiler inside: a cooling plate from a text, stepped by the host, on finer and finer grids. The
// error against the exact solution falls with the square of the cell size.
#include <dpde/dpde.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdio>
#include <numbers>

const char* plate = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) }
scheme simple { lap = central(2); time = rk4 }
scene plate : heat with simple {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 1, cells 8
  boundary u: all = 0
  kappa = 1
  initial u = 0
  time 0 .. 0.02, step 1/10000
}
)";

double error(int cells) {
  dpde::Simulation sim = dpde::compile_text(plate, {.set = {{"cells", std::to_string(cells)}}});
  const std::vector<double> x = sim.coordinates(0), y = sim.coordinates(1);
  Eigen::ArrayXXd shape(cells, cells), u(cells, cells);  // (x, y): x is fastest
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i)
      shape(i, j) = std::sin(std::numbers::pi * x[i]) * std::sin(2 * std::numbers::pi * y[j]);
  }
  sim.set("kappa", 0.5);
  sim.set_initial("u", shape);
  sim.run_to(0.01);
  sim.step(50);
  sim.run([](const dpde::Progress&) { return true; });  // to the end; false would stop it
  sim.state("u", u);
  return (u - std::exp(-5 * std::numbers::pi * std::numbers::pi * 0.5 * sim.time()) * shape).abs().maxCoeff();
}

int main() {
  try {
    const double coarse = error(16), fine = error(32), order = std::log2(coarse / fine);
    std::printf("errors %.3e and %.3e: order %.2f\n", coarse, fine, order);
    return std::abs(order - 2) < 0.15 ? 0 : 1;
  } catch (const dpde::Error& problem) {
    std::fputs(problem.what(), stderr);  // with the lines of the text, as dpde shows them
    return 2;
  }
}
