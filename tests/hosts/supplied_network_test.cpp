// SPDX-License-Identifier: Apache-2.0
// Networks that the host computes itself, beside the same ones as layers of the model.
#include <algorithm>
#include <cmath>

#include "host_support.h"

namespace dpde::testing {
namespace {

using In = HostNetwork::In;
using Out = HostNetwork::Out;

std::string scene_with_network(const std::string& network, const std::string& more = "") {
  return "network closure(u: vector, nu) -> vector { " + network + R"( }
model m { vector u; param nu; dt(u) = nu*lap(u) + closure(u, nu) }
scheme s { time = rk2; networks = f64)" +
         more + R"( }
scene r : m with s {
  grid x = 0 .. 1, cells 5, periodic
  grid y = 0 .. 1, cells 3
  boundary u.x: y = 0
  boundary u.y: y = zero_gradient
  nu = 0.02
  initial u = (sin(2*pi*x) + y, cos(2*pi*x)*y)
  time 0 .. 0.2, step 0.02
}
task t : r { learn closure; unknown nu; unknown initial u.x; minimise mean((u.x - 0.5)^2 + u.y^2) over time })";
}
const std::string layers = "initial he, seed 3; dense 4; tanh; dense out", host = "host weights 26";
constexpr std::size_t inputs = 3, hidden = 4, outputs = 2;

/// dense 4, tanh, dense out; weights as network_abi.h orders them.
struct Cell {
  In weights;
  double middle[hidden], out[outputs];
  Cell(In x, In w, std::size_t cell, std::size_t cells) : weights(w) {
    for (std::size_t h = 0; h < hidden; ++h) {
      middle[h] = w[inputs * hidden + h];
      for (std::size_t i = 0; i < inputs; ++i) middle[h] += w[h * inputs + i] * x[i * cells + cell];
      middle[h] = std::tanh(middle[h]);
    }
    for (std::size_t o = 0; o < outputs; ++o) {
      out[o] = w[16 + outputs * hidden + o];
      for (std::size_t h = 0; h < hidden; ++h) out[o] += w[16 + o * hidden + h] * middle[h];
    }
  }
};

void value(In x, In w, Out y) {
  const std::size_t cells = x.size() / inputs;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const Cell all(x, w, cell, cells);
    for (std::size_t o = 0; o < outputs; ++o) y[o * cells + cell] = all.out[o];
  }
}

void vector_jacobian(In x, In w, In seeds, Out x_bar, Out w_bar) {
  const std::size_t cells = x.size() / inputs;
  std::ranges::fill(x_bar, 0.0);
  std::ranges::fill(w_bar, 0.0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const Cell all(x, w, cell, cells);
    for (std::size_t h = 0; h < hidden; ++h) {
      double bar = 0;
      for (std::size_t o = 0; o < outputs; ++o) {
        bar += w[16 + o * hidden + h] * seeds[o * cells + cell];
        w_bar[16 + o * hidden + h] += all.middle[h] * seeds[o * cells + cell];
      }
      bar *= 1 - all.middle[h] * all.middle[h];
      w_bar[inputs * hidden + h] += bar;
      for (std::size_t i = 0; i < inputs; ++i) {
        w_bar[h * inputs + i] += bar * x[i * cells + cell];
        x_bar[i * cells + cell] += bar * w[h * inputs + i];
      }
    }
    for (std::size_t o = 0; o < outputs; ++o) w_bar[16 + outputs * hidden + o] += seeds[o * cells + cell];
  }
}

double worst(const std::vector<double>& a, std::span<const double> b) {
  double most = a.size() == b.size() ? 0 : 1e300;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

void expect_error(const std::function<void()>& run, const std::string& part) {
  try {
    run();
    ADD_FAILURE() << "no error that says " << part;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(SuppliedNetworks, GiveTheGradientsOfTheSameLayers) {
  for (const auto& [precision, tolerance] : {std::pair{"", 1e-13}, {"; real = f32", 2e-5}}) {
    Simulation own = compile_text(scene_with_network(layers, precision), {.name = "t"});
    const double loss = own.gradient();
    const std::vector<double> weights = own.weights("closure"),
                              expected(own.gradient_vector().begin(), own.gradient_vector().end());
    const double scale = *std::ranges::max_element(expected, {}, [](double g) { return std::abs(g); });
    for (const HostBackend backend : {HostBackend::jit, HostBackend::cpp, HostBackend::interpreter}) {
      Simulation sim = compile_text(scene_with_network(host, precision), {.name = "t", .backend = backend});
      EXPECT_EQ(sim.weights("closure"), std::vector<double>(26));
      sim.supply("closure", {value, vector_jacobian});
      sim.set_weights("closure", weights);
      EXPECT_NEAR(sim.gradient(), loss, tolerance * loss);
      EXPECT_LT(worst(expected, sim.gradient_vector()), tolerance * std::abs(scale));
      own.reset();
      sim.reset();
      own.step(4);
      sim.step(4);
      EXPECT_LT(worst(own.state("u.y"), sim.state("u.y")), tolerance);
    }
  }
}

TEST(SuppliedNetworks, AreComparedWithDifferencesWhenTheyAreUsed) {
  Simulation sim = compile_text(scene_with_network(host), {.name = "t"});
  expect_error([&] { sim.loss(); }, "network closure is the host's own: supply() its value");
  sim.set_weights("closure", random_values(26, 7));
  sim.supply("closure", {value, {}});
  EXPECT_GT(sim.loss(), 0);
  expect_error([&] { sim.gradient(); }, "no vector-Jacobian product");
  sim.supply("closure", {value, [](In x, In w, In seeds, Out x_bar, Out w_bar) {
                           vector_jacobian(x, w, seeds, x_bar, w_bar);
                           for (double& bar : x_bar) bar *= 1.1;
                         }});
  expect_error([&] { sim.gradient(); }, "along a direction of its inputs");
  sim.supply("closure", {value, [](In x, In w, In seeds, Out x_bar, Out w_bar) {
                           vector_jacobian(x, w, seeds, x_bar, w_bar);
                           std::ranges::fill(w_bar, 0.0);
                         }});
  expect_error([&] { sim.gradient(); }, "along a direction of its weights");
  sim.supply("closure", {[](In x, In w, Out y) {
                           value(x, w, y);
                           y[7] = std::nan("");
                         },
                         vector_jacobian});
  expect_error([&] { sim.loss(); }, "gives nan for finite inputs, first in value 7");
  // With weights of 0 nothing depends on the inputs: what is wrong there shows with others.
  sim.set_weights("closure", std::vector<double>(26));
  sim.supply("closure", {value, [](In x, In w, In seeds, Out x_bar, Out w_bar) {
                           vector_jacobian(x, w, seeds, x_bar, w_bar);
                           std::ranges::fill(x_bar, 0.0);
                         }});
  EXPECT_GT(sim.gradient(), 0);
  sim.set_weights("closure", random_values(26, 7));
  expect_error([&] { sim.gradient(); }, "along a direction of its inputs");
  sim.supply("closure", {value, vector_jacobian});
  EXPECT_GT(sim.gradient(), 0);
  expect_error([&] { sim.supply("clsure", {value, {}}); }, "clsure");
  Simulation own = compile_text(scene_with_network(layers), {.name = "t"});
  expect_error([&] { own.supply("closure", {value, {}}); }, "has layers of its own");
}

}  // namespace
}  // namespace dpde::testing
