// SPDX-License-Identifier: Apache-2.0
// Control fields, one field per time interval, against closed forms: gradients by interval and cell; the same for any
// number of threads, stored states, and steps in one pass.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "dpde/runtime/random.h"
#include "driver/scene/inverse.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

using Values = std::vector<double>;

/// u grows by dt*F in each of 8 steps; three intervals of 3, 3 and 2 steps.
std::string pushes(const std::string& formula, const std::string& task, int cells = 5) {
  return "model m { field u; control field F; param a; dt(u) = F }\nscheme c { time = euler }\nscene s : m with c {\n"
         "  grid x = 0 .. 1, cells " +
         std::to_string(cells) + ", periodic\n  a = 2\n  initial u = x\n  time 0 .. 1, step 1/8\n  F = " + formula +
         " every 3/8\n}\n"
         "task t : s {\n  unknown F from a*x*t^2\n  " +
         task + "\n}\n";
}
constexpr double middle[] = {1.5 / 8, 4.5 / 8, 7.5 / 8}, length[] = {3. / 8, 3. / 8, 2. / 8};
double place(std::size_t i, int cells) { return (static_cast<double>(i) + 0.5) / cells; }

TEST(ControlField, HasAFieldEachInterval) {
  for (const int cells : {1, 2, 3, 5}) {
    const Values u = run_scene(pushes("a*sin(x)*t^2", "minimise mean(u^2)", cells), "s").state.at("u");
    for (std::size_t i = 0; i < u.size(); ++i) {
      double expected = place(i, cells);
      for (int k = 0; k < 3; ++k) expected += length[k] * 2 * std::sin(place(i, cells)) * middle[k] * middle[k];
      EXPECT_NEAR(u[i], expected, 1e-14) << cells;
    }
  }
}

TEST(ControlField, IsTheSameOnEveryBackEnd) {
  const std::string text = pushes("a*exp(x)*sin(t)", "minimise mean(u^2)");
  const Values jit = run_scene(text, "s").state.at("u");
  for (const driver::Backend backend : {driver::Backend::interpreter, driver::Backend::cpp}) {
    const Values other = run_scene(text, "s", {}, backend).state.at("u");
    for (std::size_t i = 0; i < jit.size(); ++i) EXPECT_NEAR(other[i], jit[i], 1e-15);
  }
}

/// d mean(u(1)^2)/dF[k] = 2 u(1) dt (steps of interval k)/cells.
TEST(ControlField, GradientIsByIntervalAndCell) {
  for (const int cells : {1, 2, 3, 5}) {
    const TaskResult result = task_gradient(pushes("0", "minimise mean(u^2)", cells), "t");
    const Values& g = result.gradient.at("F");
    ASSERT_EQ(g.size(), 3u * static_cast<std::size_t>(cells));
    for (std::size_t i = 0; i < static_cast<std::size_t>(cells); ++i) {
      const double x = place(i, cells);
      double u = x;
      for (int k = 0; k < 3; ++k) u += length[k] * 2 * x * middle[k] * middle[k];
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(g[k * static_cast<std::size_t>(cells) + i], 2 * u * length[k] / cells, 1e-15);
    }
  }
}

/// The mean of F^2 over the 9 states, three in each interval; the last interval includes the end.
TEST(ControlField, CostsSomethingInTheLoss) {
  const TaskResult result = task_gradient(pushes("0", "minimise mean(F^2) over time"), "t");
  double loss = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double f = 2 * place(i, 5) * middle[k] * middle[k];
      loss += f * f / 15;
      EXPECT_NEAR(result.gradient.at("F")[5 * k + i], 2 * f / 15, 1e-15);
    }
  }
  EXPECT_NEAR(result.loss, loss, 1e-14);
}

TEST(ControlField, NoiseIsDrawnAnewInEachInterval) {
  const Values u = run_scene(pushes("a*noise(7)", "minimise mean(u^2)"), "s").state.at("u");
  for (std::size_t i = 0; i < 5; ++i) {
    double expected = place(i, 5);
    for (std::size_t k = 0; k < 3; ++k) expected += length[k] * 2 * normal(7, i, k);
    EXPECT_NEAR(u[i], expected, 1e-14);
  }
  EXPECT_NE(normal(7, 0, 0), normal(7, 0, 1));
}

/// With neighbours (ghost cells in each interval), in boundary values, events, losses and stages; intervals that do not
/// divide the run; two control fields with different intervals, a vector of them, and an additional control.
const char* const rich =
    "model m {\n  field u\n  param nu\n  control field F, G\n  control K\n  dt(u) = nu*lap(u) + dx(F) - F*u^2 + div((1 "
    "+ G^2)*grad(u))/50 + x*K\n}\n"
    "scheme c { time = rk2 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 9\n  boundary u: x.low = G*sin(t), x.high "
    "= gradient(F)\n  nu = 0.02\n"
    "  initial u = sin(x)\n  time 0 .. 1, step 1/32\n  F = cos(t)*x every 5/32\n  G = 0.3 + x*t every 1/4\n  K = t "
    "every 1/8\n  every 1/4: u += 0.1*F\n}\n"
    "task t : s {\n  unknown F\n  unknown G from t\n  unknown K\n  unknown nu\n  minimise mean(u^2) at t = 0.25, 1\n  "
    "minimise mean(F*u^2) + 0.1*mean(dx(G)^2) over time\n}\n";

TEST(ControlField, DerivativesAreCertified) { expect_certified(rich, true); }

TEST(ControlField, DerivativesInTwoAndThreeDimensions) {
  for (const int axes : {2, 3}) {
    std::string grid, walls;
    for (int a = 0; a < axes; ++a)
      grid += std::string("  grid ") + "xyz"[a] + " = 0 .. 1, cells 4" + (a == 1 ? "" : ", periodic") + "\n";
    expect_certified(
        "model m { field u; control vector F; dt(u) = 0.01*lap(u) + div(u*F) }\nscheme c { time = euler }\nscene s : m "
        "with c {\n" +
            grid + "  boundary u: y = zero_gradient\n  F.x = sin(t)*y every 0.2\n  F.y = x" +
            (axes == 3 ? "\n  F.z = z*t" : "") +
            "\n  initial u = 1 + x\n  time 0 .. 0.5, step 0.1\n}\ntask t : s {\n  unknown F\n  unknown initial u\n  "
            "minimise mean(u^4)\n}\n",
        true);
  }
}

TEST(ControlField, DerivativesOfPartsOfSteps) {
  expect_certified(
      "model m { field u; control field F; dt(u) = -advect(F, u) }\nscheme c { advect = central(2); time = rk2 "
      "}\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 8, periodic\n  F = 1 + 0.5*sin(2*pi*x)*t every 0.15\n  initial u = 1 + "
      "0.3*sin(2*pi*x)\n  time 0 .. 0.4, step 0.05, courant 0.2\n}\n"
      "task t : s {\n  unknown F\n  unknown initial u\n  minimise mean(u^4)\n}\n",
      false);
  expect_certified(
      "model m { field u, c; control field F; dt(u) = 0.01*lap(u) + F*c; dt(c) = -3*F*c + u }\nscheme r { time = rk2 "
      "}\nscene s : m with r {\n"
      "  grid x = 0 .. 1, cells 6, periodic\n  F = 1 + x*t every 0.2\n  initial u = x\n  initial c = 1\n  subcycle c "
      "in 4\n  time 0 .. 0.5, step 0.1\n}\n"
      "task t : s {\n  unknown F\n  minimise mean(u^2*c)\n}\n",
      false);
}

TEST(ControlField, DerivativesOfStaggeredAndCarried) {
  expect_certified(
      "model m { vector u on faces; field p; control vector F on faces; dt(u) = -grad(p) + F; dt(p) = -div(u) "
      "}\nscheme c { time = rk2 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 1, cells 4, periodic\n  boundary u: x = 0\n  "
      "boundary p: x = zero_gradient\n"
      "  F = (sin(t)*y, x*t)\n  initial u = 0\n  initial p = x\n  time 0 .. 0.3, step 0.1\n}\n"
      "task t : s {\n  unknown F\n  minimise mean(p^2)\n  minimise 0.1*mean(u.y^4) over time\n}\n",
      true);
  expect_certified(
      "model m { field u; control field F; dt(u) = -advect(F, u) + 0.1*F }\nscheme c { advect = semi_lagrangian; time "
      "= euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 8, periodic\n  F = 0.7 + 0.3*x*t every 0.2\n  initial u = sin(2*pi*x)\n  time 0 .. "
      "0.5, step 0.1\n}\n"
      "task t : s {\n  unknown F\n  minimise mean(u^2)\n}\n",
      false);
}

/// The gradient of `rich` with this number of threads and stored states.
Eigen::VectorXd gradient_with(int threads, int slots, const std::string& text) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  DiagnosticSink sink;
  driver::SessionOptions session_options;
  session_options.threads = threads;
  session_options.slots = slots;
  const auto session = driver::Session::open(source, compiled(source, options), session_options, sink);
  EXPECT_TRUE(session) << all_messages(source, sink);
  const auto inverse = driver::Inverse::open(*session, source, sink);
  Eigen::VectorXd gradient(inverse->size());
  inverse->value_and_gradient(inverse->start(), gradient);
  inverse->value_and_gradient(inverse->start() * 1.5, gradient);  // fields and their ghost cells changed
  return gradient;
}

TEST(ControlField, GradientIsTheSameForAnyThreadsAndStoredStates) {
  std::string plane = rich;
  plane.replace(plane.find("cells 9\n"), 8, "cells 9\n  grid y = 0 .. 1, cells 7, periodic\n");
  for (const std::string& text : {std::string(rich), plane}) {
    const Eigen::VectorXd expected = gradient_with(1, 0, text);
    EXPECT_TRUE(expected.allFinite());
    for (const int threads : {1, 2, 3}) {
      for (const int slots : {1, 3, 5})
        EXPECT_EQ(gradient_with(threads, slots, text), expected) << threads << " threads, " << slots << " states";
    }
  }
}

/// Temporal blocking of several steps never crosses the end of an interval.
TEST(ControlField, StatesAreThoseOfSingleSteps) {
  const std::string text =
      "model m { field u; control field F; dt(u) = 0.0001*lap(u) + F + 0.01*dx(F) }\nscheme c { time = euler }\nscene "
      "s : m with c {\n"
      "  grid x = 0 .. 1, cells 17, periodic\n  grid y = 0 .. 1, cells 40\n  boundary u: y = zero_gradient\n  F = "
      "sin(7*x + y)*cos(9*t) every 0.05\n"
      "  initial u = x\n  time 0 .. 0.23, step 0.01\n}\n";
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << all_messages(source, sink);
  const auto end = [&](int block_steps, int by_hand) {
    RolloutSetup setup = session->setup();
    setup.block_steps = block_steps;
    Rollout rollout(std::move(setup));
    EXPECT_EQ(rollout.block_steps(), block_steps);
    rollout.initial(0).copy_in(session->initial(0));
    if (by_hand > 0) rollout.restart();
    for (int n = 0; by_hand > 0 && n < 23; n += by_hand) rollout.advance(std::min(by_hand, 23 - n));
    if (by_hand == 0) rollout.run();
    Values values(session->workspace().cell_count());
    copy_out(session->workspace().layout(), by_hand > 0 ? rollout.present()[0] : rollout.final_states()[0], values);
    return values;
  };
  const Values expected = end(1, 0);
  for (const int steps : {2, 3, 4, 8}) EXPECT_EQ(end(steps, 0), expected) << steps;
  for (const int steps : {1, 4, 23}) EXPECT_EQ(end(1, steps), expected) << steps;
}

}  // namespace
}  // namespace dpde::testing
