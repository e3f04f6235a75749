// SPDX-License-Identifier: Apache-2.0
// A host with a function of its own inside an equation, and its derivative: growth w0 + w1*u + w2*u^2, which dpde knows
// nothing of. Its three weights are found from what a spreading population looks like in the end.
#include <dpde/dpde.h>

#include <cmath>
#include <cstdio>

const char* spread = R"(
network growth(u) { host weights 3 }
model population { field u; param k; coefficient seen; dt(u) = k*lap(u) + growth(u) }
scheme simple { time = rk4 }
scene line : population with simple {
  grid x = 0 .. 1, cells 64
  boundary u: all = zero_gradient
  k = 1e-3
  seen = 0
  initial u = 0.05 + 0.5*exp(-100*(x - 0.3)^2)
  time 0 .. 2, step 1/50
}
task find : line { learn growth; minimise mean((u - seen)^2); using lbfgs(), iterations 100 }
)";

using In = dpde::HostNetwork::In;
using Out = dpde::HostNetwork::Out;

void growth(In u, In w, Out rate) {
  for (std::size_t i = 0; i < u.size(); ++i) rate[i] = w[0] + u[i] * (w[1] + u[i] * w[2]);
}

void growth_backward(In u, In w, In seed, Out u_bar, Out w_bar) {
  w_bar[0] = w_bar[1] = w_bar[2] = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    u_bar[i] = seed[i] * (w[1] + 2 * w[2] * u[i]);
    w_bar[0] += seed[i];
    w_bar[1] += seed[i] * u[i];
    w_bar[2] += seed[i] * u[i] * u[i];
  }
}

int main() {
  try {
    dpde::Simulation sim = dpde::compile_text(spread, {.name = "find"});
    sim.supply("growth", {growth, growth_backward});  // compared with differences when a gradient uses it first
    sim.set_weights("growth", std::vector<double>{0, 1, -1});
    sim.run();
    sim.set_field("seen", sim.state("u"));
    sim.set_weights("growth", std::vector<double>{0.1, 0.1, 0.1});
    const dpde::Optimised found = sim.optimise();
    const std::vector<double> w = sim.value_of("growth");
    std::printf("loss %.1e after %d updates: growth = %.4f + %.4f*u + %.4f*u^2\n", found.loss, found.iterations, w[0],
                w[1], w[2]);
    return std::abs(w[1] - 1) + std::abs(w[2] + 1) < 1e-2 ? 0 : 1;
  } catch (const dpde::Error& problem) {
    std::fputs(problem.what(), stderr);
    return 2;
  }
}
