// SPDX-License-Identifier: Apache-2.0
// Masks with prescribed motion: against fixed masks, against the added mass of a cylinder; divergence, gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../driver/driver_support.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Fluid in a box with the obstacle `solid`, its velocity and a time scheme.
std::string box(const std::string& solid, const std::string& velocity = "(0.3*cos(5*t), 0.1)",
                const std::string& time = "rk2") {
  return R"(
model flow {
  vector u on faces
  field p
  param nu, a
  mask solid
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = )" +
         velocity +
         R"( inside solid
}
scheme c { time = )" +
         time + R"( }
scene s : flow with c {
  grid x = 0 .. 1, cells 10
  grid y = 0 .. 1, cells 9, periodic
  nu = 0.02
  a = 0.3
  solid = )" +
         solid + R"(
  boundary u: x = (0, 0)
  initial u.x = 0
  initial u.y = 0.2*sin(pi*x)
  time 0 .. 0.4, step 1/40
}
)";
}

/// The observable of the scene s at its end.
double observed_force(const std::string& text, const char* cells) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.overrides = {{"cells", cells}};
  DiagnosticSink sink;
  const auto code = compiled(source, options);
  const auto session = code ? driver::Session::open(source, code, {}, sink) : nullptr;
  if (!session) return NAN;
  session->rollout().run();
  return session->observe(session->end_time(), session->rollout().final_states()).front().second;
}

void expect_same(const SceneResult& a, const SceneResult& b, double error) {
  for (const auto& [name, values] : a.state) {
    const std::vector<double>& others = b.state.at(name);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], others[i], error) << name << " " << i;
  }
}

/// A mask that depends only on coordinates, and the same with t in its formula.
TEST(MovingMask, ThatStaysIsAFixedOne) {
  for (const char* time : {"euler", "rk4", "ab2", "imex_euler"}) {
    const SceneResult fixed = run_scene(box("(x - 0.5)^2 + (y - 0.5)^2 < 0.04", "(0.1, 0.2)", time), "s");
    const SceneResult moving = run_scene(box("(x - 0.5)^2 + (y - 0.5)^2 < 0.04 + 1e-9*t", "(0.1, 0.2)", time), "s");
    expect_same(fixed, moving, 1e-13);
  }
}

/// A mask that jumps between two steps: after the last stage of a step the mask is that of the step's end.
TEST(MovingMask, IsTheOneOfEachTime) {
  const auto state_at = [](const std::string& solid, const char* end) {
    return run_scene(box(solid), "s", {{"end", end}});
  };
  const std::string first = "abs(x - 0.35) < 0.16 and abs(y - 0.5) < 0.2";
  const std::string second = "abs(x - 0.65) < 0.16 and abs(y - 0.5) < 0.2";
  const std::string jumps = "abs(x - if(t < 0.2125, 0.35, 0.65)) < 0.16 and abs(y - 0.5) < 0.2";
  expect_same(state_at(jumps, "0.2"), state_at(first, "0.2"), 1e-13);
  const SceneResult end = state_at(jumps, "0.4");
  const std::vector<double>&u = end.state.at("u.x"), &v = end.state.at("u.y");
  for (int y = 3; y < 6; ++y) {  // inside the second one
    EXPECT_EQ(u[static_cast<std::size_t>(y * 10 + 6)], 0.3 * std::cos(5 * 0.4));
    EXPECT_EQ(v[static_cast<std::size_t>(y * 10 + 6)], 0.1);
    EXPECT_NE(u[static_cast<std::size_t>(y * 10 + 2)], u[static_cast<std::size_t>(y * 10 + 6)]);
  }
}

/// A cylinder in a box that starts to move takes fluid with it. Far from walls this is the fluid of its own volume
/// (Lamb, Hydrodynamics, 68). Walls act as images: dipoles at the points (m, n) with the sign of (-1)^m, whose velocity
/// at the cylinder is S = -pi^2/3 + 2*sum_m (-1)^m*pi^2/sinh(pi*m)^2 in units of U*r^2. The mass is pi*r^2*(1 -
/// 2*S*r^2/(1 + S*r^2)) up to terms of r^4. The rest of the error comes from the staircase.
TEST(MovingMask, ACylinderThatStartsHasItsAddedMass) {
  const std::string text = R"(
model flow {
  vector u on faces
  field p
  mask solid
  dt(u) = -advect(u, u) - grad(p)
  0 = div(u) gives p
  u = (t, 0) inside solid
}
scheme c { time = euler }
scene s : flow with c {
  grid x = -1/2 .. 1/2, cells 40
  grid y = -1/2 .. 1/2, cells 40
  solid = (x - t^2/2)^2 + y^2 < 0.1^2
  boundary u: all = (0, 0)
  initial u = 0
  time 0 .. 1e-3, step 1e-3
  observe force = force_on(solid, u.x)
}
)";
  const double pi = std::numbers::pi, image = -pi * pi / 3 - 2 * pi * pi / std::pow(std::sinh(pi), 2);
  const double moved = image * 0.01 / (1 + image * 0.01), mass = pi * 0.01 * (1 - 2 * moved);
  const auto force = [&](const char* cells) { return observed_force(text, cells); };
  EXPECT_NEAR(force("40") / -mass, 1, 0.13);
  EXPECT_NEAR(force("80") / -mass, 1, 0.09);
}

TEST(MovingMask, TheDivergenceIsZeroAndDerivativesAreCertified) {
  const std::string text = box("(x - 0.5 - a*sin(5*t)/5)^2 + (y - 0.5 - 0.1*t)^2 < 0.04") +
                           "task d : s {\n  unknown nu\n  minimise mean(div(u)^2) at t = 0.1, 0.2, 0.4\n}\n";
  EXPECT_LT(task_loss(text, "d"), 1e-20);
  std::string task = box("(x - 0.5 - 0.3*sin(5*t)/5)^2 + (y - 0.5)^2 < 0.04", "(a*cos(5*t), 0.1*a^2)");
  task +=
      "task t : s {\n  unknown nu\n  unknown a\n  unknown initial u\n  minimise mean(u.x^2) + 0.1*force_on(solid, "
      "u.y) over time\n  minimise mean(u.y^3)\n}\n";
  expect_certified(task, false);
  for (std::string from = ", periodic"; task.find(from) != std::string::npos;) task.erase(task.find(from), from.size());
  task.replace(task.find("x = (0, 0)"), 10, "all = (0, 0)");
  expect_certified(task, false);
}

}  // namespace
}  // namespace dpde::testing
