// SPDX-License-Identifier: Apache-2.0
// HostOptions::inputs: the transposed derivative of a scene's end, by dot products of linear scenes, by Taylor
// remainders of others, on tiny grids too.
#include <cmath>

#include "host_support.h"

namespace dpde {
namespace {

using testing::dot;
using testing::random_values;

const char* const rods = R"(model heat { field u; param k; coefficient a
  dt(u) = k*div(a*grad(u)) }
model burgers { field u; param k
  dt(u) = -u*dx(u) + k*lap(u) }
scheme stiff { implicit = all; time = ars222 }
scene between_walls : heat { grid x = 0 .. 1, cells 8
  boundary u: x = 0
  k = 0.001
  a = 1 + x
  initial u = 1
  time 0 .. 1, step 1/8 }
scene implicit = between_walls with stiff { k = 1 }
scene shock : burgers { grid x = 0 .. 1, cells 8, periodic
  k = 0.01
  initial u = k*sin(2*pi*x)
  time 0 .. 0.25, step 1/64 }
)";

double end_times(Simulation& sim, const std::vector<double>& seed) {
  sim.reset();
  sim.run();
  return dot(seed, sim.state("u"));
}

TEST(Inputs, LinearScenesByDotProducts) {
  for (const char* scene : {"between_walls", "implicit"}) {
    for (const int cells : {1, 2, 3, 8}) {
      Simulation sim = compile_text(rods, {.name = scene, .set = {{"cells", std::to_string(cells)}}, .inputs = {"u"}});
      const std::vector<double> u = random_values(sim.size(), 1), seed = random_values(sim.size(), 2);
      sim.set_initial("u", u);
      sim.set_field("u_seed", seed);
      const double value = end_times(sim, seed);
      EXPECT_NEAR(sim.gradient(), value, 1e-13) << scene << cells;
      EXPECT_NEAR(dot(sim.gradient_of("u"), u), value, 1e-12) << scene << cells;  // the end is linear in u
    }
  }
}

/// The remainder of half the step is a quarter.
void expect_taylor(const std::string& scene, int cells, const std::vector<std::string>& inputs) {
  Simulation sim = compile_text(rods, {.name = scene, .set = {{"cells", std::to_string(cells)}}, .inputs = inputs});
  const std::vector<double> seed = random_values(sim.size(), 3);
  if (sim.unknowns().front() == "u") sim.set_initial("u", random_values(sim.size(), 4));
  sim.set_field("u_seed", seed);
  const double value = sim.gradient();
  const std::vector<double> x = sim.unknown_values();
  std::vector<double> along = random_values(x.size(), 5);
  for (std::size_t i = 0; i < x.size(); ++i) along[i] *= x[i];
  const double slope = dot(sim.gradient_vector(), along);
  const auto remainder = [&](double h) {
    std::vector<double> moved = x;
    for (std::size_t i = 0; i < x.size(); ++i) moved[i] += h * along[i];
    sim.set_unknowns(moved);
    return end_times(sim, seed) - value - h * slope;
  };
  EXPECT_NEAR(std::log2(remainder(2e-3) / remainder(1e-3)), 2, 0.05) << scene << cells;
}

TEST(Inputs, OthersByTaylorRemainders) {
  for (const int cells : {3, 8}) {
    expect_taylor("shock", cells, {"u", "k"});
    expect_taylor("between_walls", cells, {"u", "k", "a"});
    expect_taylor("implicit", cells, {"u", "k", "a"});
  }
}

TEST(Inputs, FormulasOfOtherFieldsCount) {  // the initial state is no input, and holds k
  Simulation sim = compile_text(rods, {.name = "shock", .inputs = {"k"}});
  const std::vector<double> seed = random_values(sim.size(), 6);
  sim.set_field("u_seed", seed);
  sim.gradient();
  const double slope = sim.gradient_of("k")[0], h = 1e-5;
  sim.set("k", 0.01 + h);
  const double above = end_times(sim, seed);
  sim.set("k", 0.01 - h);
  EXPECT_NEAR(slope, (above - end_times(sim, seed)) / (2 * h), 1e-7);
}

TEST(Inputs, WhatCannotBeOneIsRefused) {
  const auto text_of = [](const HostOptions& options) -> std::string {
    try {
      compile_text(rods, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(text_of({.name = "shock", .inputs = {"nothing"}}).find("nothing is not known here"), std::string::npos);
  EXPECT_NE(text_of({.name = "shock", .inputs = {"u\n}"}}).find("inputs are names"), std::string::npos);
  EXPECT_NE(text_of({.name = "shock", .inputs = {"initial u"}}).find("inputs are names"), std::string::npos);
  EXPECT_NE(text_of({.name = "shock", .inputs = {"u from 3"}}).find("inputs are names"), std::string::npos);
  EXPECT_NE(text_of({.name = "none", .inputs = {"u"}}).find("no scene called \"none\""), std::string::npos);
  EXPECT_NE(text_of({.inputs = {"u"}}).find("between_walls, implicit, shock"), std::string::npos)
      << text_of({.inputs = {"u"}});
  Simulation sim = compile_text(rods, {.name = "shock", .inputs = {"u"}});
  try {
    sim.gradient();
    FAIL() << "without a seed";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("u_seed"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace dpde
