// SPDX-License-Identifier: Apache-2.0
// Semi-Lagrangian transport against published numbers and closed forms.
#include <gtest/gtest.h>

#include <numbers>

#include "stencil/model_builder.h"
#include "stencil/scene_run.h"

namespace lowering_transport {
namespace {

using namespace model_builder;
using scene_run::Scene;

constexpr double pi = std::numbers::pi;
const Expr u = field("u"), v = field("v");

model::Problem burgers() {
  model::Problem p = problem({state("u", -advect({u}, u) + param("nu") * lap(u))}, {128});
  p.axes[0].low = -1;
  p.axes[0].high = 1;
  p.states[0].initial.formula = -call(Fn::sin, param("pi") * coordinate(0));
  p.step = 1.0 / 32;
  p.steps = 32;
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.scheme.transport.order = 1;
  return p;
}

TEST(LoweringTransport, BurgersOfTheBook) {  // systems.md 2.2, row A2
  Scene scene(burgers(), {{"nu", 0.01 / (128 * pi)}, {"pi", pi}});
  scene.run("s_initial");
  const std::vector<double> start = scene.get("u");
  const std::vector<double> printed{0.49289819, 0.53499762, 0.57580819, 0.61523159, 0.65317284};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(start[10 + i], printed[i], 5e-8);
  scene.step(32);
  const std::vector<double> end = scene.get("u");
  const std::vector<double> recomputed{0.00572276, 0.01716714, 0.02861029, 0.04005201, 0.0514921};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(end[i], recomputed[i], 1e-8);
}

TEST(LoweringTransport, WholeCellsAreMovedExactly) {
  model::Problem p = problem({state("u", -advect({-3.0}, u))}, {10}, 10);
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.step = 1;
  Scene scene(p);
  const std::vector<double> start{1, 2, 4, 8, 16, 32, 64, 128, 256, 512};
  scene.set("u", start);
  scene.step(1);
  EXPECT_EQ(scene.get("u"), (std::vector<double>{8, 16, 32, 64, 128, 256, 512, 1, 2, 4}));
}

TEST(LoweringTransport, LinearInterpolationDampsAsItsModifiedEquation) {  // numerics.md 1: h^2 f(1 - f)/(2 dt)
  model::Problem p = problem({state("u", -advect({1.0}, u))}, {64}, 2 * pi);
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  const double h = p.axes[0].spacing();
  p.step = 0.5 * h;
  Scene scene(p);
  scene.set("u", [](double x) { return std::sin(x); });
  scene.step(128);
  const double diffusion = h * h * 0.25 / (2 * p.step);
  EXPECT_LT(scene.error("u", [&](double x) { return std::exp(-diffusion * 128 * p.step) * std::sin(x); }), 1e-4);
}

TEST(LoweringTransport, FlowTimeIsThatOfTheArrival) {  // velocity t: back from t + dt, by dt*(t + dt)/h = 2 cells
  model::Problem p = problem({state("u", -advect({param("t")}, u) + 1.0)}, {8}, 8);
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.step = 1;
  p.t_begin = 1;
  Scene scene(p);
  scene.set("u", {0, 1, 2, 3, 4, 5, 6, 7});
  scene.step(1);
  EXPECT_EQ(scene.get("u"), (std::vector<double>{7, 8, 1, 2, 3, 4, 5, 6}));
}

TEST(LoweringTransport, BoundedAxesBringInTheirBoundaryValue) {
  model::Problem p = problem({state("u", -advect({1.0}, u))}, {4}, 4, Topology::bounded);
  p.states[0].boundary[0].low.value = 7.0;
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.step = 2;
  Scene scene(p);
  scene.set("u", {1, 2, 3, 4});
  scene.step(1);
  EXPECT_EQ(scene.get("u"), (std::vector<double>{7, 7, 1, 2}));
}

TEST(LoweringTransport, SeveralFieldsInTwoDimensions) {
  model::Problem p = problem(
      {state("u", -advect({u, v}, u)), state("v", -advect({u, v}, v)), state("ink", -advect({u, v}, field("ink")))},
      {4, 4}, 4);
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.step = 1;
  Scene scene(p);
  scene.set("u", std::vector<double>(16, 1.0));
  scene.set("v", std::vector<double>(16, -1.0));
  std::vector<double> ink(16, 0.0);
  ink[5] = 1;  // (1, 1)
  scene.set("ink", ink);
  scene.step(1);
  ink[5] = 0;
  ink[2] = 1;  // (2, 0)
  EXPECT_EQ(scene.get("ink"), ink);
  EXPECT_EQ(scene.get("u"), std::vector<double>(16, 1.0));
}

}  // namespace
}  // namespace lowering_transport
