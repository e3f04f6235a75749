// SPDX-License-Identifier: Apache-2.0
// 0 = div(u) gives p: properties of the projection, orders in space and time, and flows with known solutions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <numeric>

#include "support/flow_texts.h"
#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::SceneResult;
using testing::task_gradient;

const std::string flow = testing::incompressible_flow + std::string(R"(
scene taylor_green : flow {
  grid x = 0 .. 2*pi, cells 64, periodic
  grid y = 0 .. 2*pi, cells 64, periodic
  nu = 0.01
  initial u = (sin(x)*cos(y), -cos(x)*sin(y))
  exact u = (sin(x)*cos(y)*exp(-2*nu*t), -cos(x)*sin(y)*exp(-2*nu*t))
  exact p = (cos(2*x) + cos(2*y))/4*exp(-4*nu*t)
  time 0 .. 1, step 0.05
}
scene drift : flow {
  grid x = 0 .. 2*pi, cells 16, periodic
  grid y = 0 .. 2*pi, cells 16, periodic
  nu = 0.05
  initial u = (1 + sin(x)*cos(y) + 0.5*sin(2*y), 0.5 - cos(x)*sin(y) + 0.3*cos(x))
  time 0 .. 1, step 1/8
}
scene channel : flow {
  grid x = 0 .. 2, cells 16
  grid y = 0 .. 1, cells 8
  nu = 0.05
  initial u = (6*y*(1 - y), 0)
  boundary u.x: x.low = 6*y*(1 - y), x.high = outflow, y = 0
  boundary u.y: x.low = 0, x.high = outflow, y = 0
  exact u = (6*y*(1 - y), 0)
  exact p = 12*nu*(2 - x)
  time 0 .. 2, step 1/128
}
scene cavity : flow {
  grid x = 0 .. 1, cells 16
  grid y = 0 .. 1, cells 16
  nu = 0.01
  initial u = 0
  boundary u.x: x = 0, y.low = 0, y.high = 1
  boundary u.y: all = 0
  time 0 .. 12, step 1/64
}
task viscosity : taylor_green { unknown nu; minimise 0.5*mean(u.x^2) + 0.5*mean(u.y^2) }
)");

/// The result of a step of dt(u) = -grad(p): the divergence-free part of u.
const std::string alone = R"(
model alone {
  vector u on faces
  field p
  param k
  dt(u) = -grad(p)
  0 = div(u) gives p
}
scheme s { time = euler }
scene ring : alone with s {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 2, cells 5
  k = 5
  initial u = (sin(k*(3*x + y)), cos(k*(x - 2*y)))
  boundary u: y = 0
  time 0 .. 1, step 1
}
)";

using State = std::map<std::string, std::vector<double>>;

constexpr int across = 6, along = 5;
const double hx = 1.0 / across, hy = 2.0 / along;

/// The initial state of `ring`: on faces, and 0 on the walls.
State raw(double k) {
  State state;
  for (int j = 0; j < along; ++j) {
    for (int i = 0; i < across; ++i) {
      const double x = (i + 0.5) * hx, y = (j + 0.5) * hy;
      state["u.x"].push_back(std::sin(k * (3 * (x + hx / 2) + y)));
      state["u.y"].push_back(j + 1 == along ? 0 : std::cos(k * (x - 2 * (y + hy / 2))));
    }
  }
  return state;
}

double product(const State& a, const State& b) {
  double sum = 0;
  for (const char* name : {"u.x", "u.y"})
    sum = std::inner_product(a.at(name).begin(), a.at(name).end(), b.at(name).begin(), sum);
  return sum;
}

double distance(const State& a, const State& b) {
  double largest = 0;
  for (const char* name : {"u.x", "u.y"}) {
    for (std::size_t i = 0; i < a.at(name).size(); ++i)
      largest = std::max(largest, std::abs(a.at(name)[i] - b.at(name)[i]));
  }
  return largest;
}

double largest_divergence(const State& state) {
  const std::vector<double>&u = state.at("u.x"), &v = state.at("u.y");
  double largest = 0;
  for (int j = 0; j < along; ++j) {
    for (int i = 0; i < across; ++i) {
      const auto at = [&](int a, int b) { return static_cast<std::size_t>((a + across) % across + across * b); };
      const double below = j == 0 ? 0 : v[at(i, j - 1)];
      largest = std::max(largest, std::abs((u[at(i, j)] - u[at(i - 1, j)]) / hx + (v[at(i, j)] - below) / hy));
    }
  }
  return largest;
}

TEST(Projection, IsIdempotentSelfAdjointAndTakesTheDivergenceAway) {
  for (const auto backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    const auto projected = [&](const char* k, const char* end) {
      return run_scene(alone, "ring", {{"k", k}, {"end", end}}, backend).state;
    };
    const State a = projected("5", "1"), twice = projected("5", "2"), b = projected("7", "1");
    EXPECT_GT(largest_divergence(raw(5)), 1);
    EXPECT_LT(largest_divergence(a), 1e-13);
    EXPECT_LT(distance(a, twice), 1e-14);
    EXPECT_GT(distance(a, raw(5)), 0.1);
    EXPECT_NEAR(product(a, raw(7)), product(raw(5), b), 1e-13);
    EXPECT_LT(product(a, a), product(raw(5), raw(5)));
  }
}

/// Only the viscous term has an error there: 2*nu*t*h^2/12 of u.
TEST(Projection, TaylorGreenVorticesHaveTheErrorOfTheStencil) {
  for (const double nu : {1e-3, 1e-2, 5e-2}) {
    const SceneResult run = run_scene(flow, "taylor_green", {{"nu", std::to_string(nu)}});
    const double h = std::numbers::pi / 32, size = 0.5 * std::exp(-2 * nu);
    EXPECT_NEAR(run.l2.at("u.x") / size / (2 * nu * h * h / 12), 1, 5e-3) << nu;
  }
}

TEST(Projection, IsOfSecondOrderInSpace) {
  std::map<std::string, std::vector<double>> errors;
  for (const char* cells : {"16", "32", "64"}) {
    for (const auto& [field, error] : run_scene(flow, "taylor_green", {{"cells", cells}}).l2)
      errors[field].push_back(error);
  }
  for (const char* field : {"u.x", "u.y", "p"}) {
    EXPECT_NEAR(std::log2(errors[field][0] / errors[field][1]), 2, 0.1) << field;
    EXPECT_NEAR(std::log2(errors[field][1] / errors[field][2]), 2, 0.03) << field;
  }
}

/// A projection after each stage keeps the order of the method, for a start without discrete divergence.
TEST(Projection, KeepsTheOrderInTime) {
  const State best = run_scene(flow, "drift", {{"time", "rk4"}, {"step", "1/256"}}).state;
  const std::pair<const char*, double> methods[] = {{"euler", 1}, {"rk2", 2}, {"ab2", 2}, {"ssp_rk3", 3},
                                                    {"ab3", 3},   {"rk4", 4}, {"bs32", 3}};
  for (const auto& [method, order] : methods) {
    const auto error = [&](const char* step) {
      return distance(run_scene(flow, "drift", {{"time", method}, {"step", step}}).state, best);
    };
    EXPECT_NEAR(std::log2(error("1/32") / error("1/64")), order, 0.25) << method;
  }
}

/// Poiseuille flow between a given profile and an open end, where p is 0.
TEST(Projection, ChannelFlowGoesOutAsItIs) {
  std::vector<double> u, p;
  for (const char* cells : {"8", "16", "32"}) {
    const int n = std::atoi(cells);
    const SceneResult run =
        run_scene(flow, "channel",
                  {{"cells.x", std::to_string(2 * n)}, {"cells.y", cells}, {"step", n == 32 ? "1/512" : "1/128"}});
    u.push_back(run.l2.at("u.x"));
    p.push_back(run.l2.at("p"));
  }
  EXPECT_LT(u[2], 2e-3);
  EXPECT_NEAR(std::log2(u[0] / u[1]), 2, 0.2);
  EXPECT_NEAR(std::log2(u[1] / u[2]), 2, 0.2);
  EXPECT_NEAR(std::log2(p[1] / p[2]), 2, 0.3);
}

/// u at the centre of the cavity at Re = 100 is -0.209149 (from a steady solver, extrapolated from grids up to 384^2).
TEST(Projection, CavityAtReynolds100HasThePublishedVelocity) {
  const auto centre = [](const char* cells, const char* step) {
    const int n = std::atoi(cells);
    const std::vector<double> u =
        run_scene(flow, "cavity", {{"cells", cells}, {"step", step}, {"time", "ssp_rk3"}}).state.at("u.x");
    const auto at = [&](int j) { return u[static_cast<std::size_t>(n / 2 - 1 + n * j)]; };
    return (at(n / 2 - 1) + at(n / 2)) / 2;
  };
  const double coarse = centre("16", "1/64"), fine = centre("32", "1/64");
  EXPECT_NEAR(fine, -0.209149, 0.008);
  EXPECT_NEAR(fine + (fine - coarse) / 3, -0.209149, 1e-3);
}

/// A body with the fluid driven past it by a force: the solves of implicit stages include it.
TEST(Projection, ImplicitStagesKnowTheObstacles) {
  const std::string text = R"(
model past {
  vector u on faces
  field p
  mask solid
  param nu
  dt(u) = (1, 0) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = 0 inside solid
}
scene body : past {
  grid x = 0 .. 1, cells 12, periodic
  grid y = 0 .. 1, cells 12, periodic
  nu = 0.1
  solid = (x - 0.4)^2 + (y - 0.5)^2 < 0.04
  initial u = 0
  time 0 .. 1, step 0.005
}
)";
  const auto mean = [&](const char* time, const char* step) {
    const std::vector<double> u = run_scene(text, "body", {{"time", time}, {"step", step}}).state.at("u.x");
    return std::accumulate(u.begin(), u.end(), 0.0) / static_cast<double>(u.size());
  };
  const double exact = mean("rk4", "0.005"), coarse = mean("ars222", "0.1") - exact,
               fine = mean("ars222", "0.05") - exact;
  EXPECT_NEAR(mean("ars222", "0.02"), exact, 1e-3 * exact);
  EXPECT_GT(std::log2(std::abs(coarse / fine)), 1.5);
}

/// Divided by the cell volumes, the operator is symmetric: arbitrarily large boxes work.
TEST(Projection, HoldsInStretchedBoxes) {
  std::string text = flow;
  for (const std::string axis : {"x", "y"}) {
    const std::string plain = "grid " + axis + " = 0 .. 1, cells 16\n",
                      stretched = "grid " + axis + " = 0 .. 1, cells 40, stretched 0.5 + 0.5*tanh(1.5*(2*" + axis +
                                  " - 1))/tanh(1.5)\n";
    text.replace(text.rfind(plain), plain.size(), stretched);
  }
  text += "task divergence : cavity { unknown nu; minimise mean(div(u)^2) }\n";
  const auto result = task_gradient(text, "divergence", {{"step", "0.0005"}, {"end", "0.005"}});
  EXPECT_LT(result.loss, 1e-20);
}

/// The energy is exp(-4*nu*t)/4, with lambda, the grid's eigenvalue, instead of 2.
TEST(Projection, GradientByTheViscosityIsTheClosedForm) {
  const double h = std::numbers::pi / 32, lambda = 2 * (2 - 2 * std::cos(h)) / (h * h);
  const auto result = task_gradient(flow, "viscosity");
  const double energy = 0.25 * std::exp(-2 * lambda * 0.01);
  EXPECT_NEAR(result.loss, energy, 1e-9);
  EXPECT_NEAR(result.gradient.at("nu").front() / (-2 * lambda * energy), 1, 1e-7);
}

}  // namespace
}  // namespace dpde
