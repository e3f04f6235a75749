// SPDX-License-Identifier: Apache-2.0
// Embedded pairs: their orders, errors against tolerances, which parts are made, refused and recorded, gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "../driver/driver_support.h"
#include "dpde/runtime/error.h"
#include "driver/session.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// u(t) = exp(sin(t)), and v(t) = sin(t) by an oscillator.
std::string oscillator(const std::string& time, const std::string& rest = "") {
  return R"(
model m { field u, v, w; dt(u) = w*u; dt(v) = w; dt(w) = -v }
scheme c { time = dopri5 }
scene s : m with c {
  grid x = 0 .. 1, cells 1, periodic
  initial u = 1
  initial v = 0
  initial w = 1
  exact u = exp(sin(t))
  exact v = sin(t)
  time )" +
         time + "\n" + rest + "}\n";
}

struct Made {
  RunResult result;
  std::vector<double> u;
  double error = 0;
};

/// A run of the scene s of the text.
Made make(const std::string& text, const Overrides& set = {}, driver::Backend backend = driver::Backend::jit,
          int threads = 1) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = backend;
  options.selection.name = "s";
  options.selection.overrides = set;
  DiagnosticSink sink;
  driver::SessionOptions with;
  with.threads = threads;
  const auto code = compiled(source, options);
  const auto session = code ? driver::Session::open(source, code, with, sink) : nullptr;
  Made made;
  if (!session) return made;
  made.result = session->rollout().run();
  made.u = session->final_state(0);
  const auto errors = session->errors(session->end_time(), session->rollout().final_states());
  for (const driver::ErrorNorms& of_field : errors) made.error = std::max(made.error, of_field.linf);
  return made;
}

TEST(StepControl, ThePairsHaveTheirOrders) {
  for (const auto& [time, order] : {std::pair{"bs32", 3.0}, {"dopri5", 5.0}}) {
    const auto error = [&](const char* step) {
      return make(oscillator("0 .. 2, step 1"), {{"time", time}, {"step", step}}).error;
    };
    const double coarse = error(order == 3 ? "1/4" : "1/16"), fine = error(order == 3 ? "1/8" : "1/32");
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.35) << time;
    EXPECT_LT(fine, order == 3 ? 1e-3 : 1e-10) << time;
  }
}

/// The error at the end is 0.5 to 60 times the tolerance over six decades; from 1e-5 on parts grow as
/// tolerance^(-1/order).
TEST(StepControl, TheErrorFollowsTheTolerance) {
  for (const auto& [time, order] : {std::pair{"bs32", 3}, {"dopri5", 5}}) {
    double before = 0;
    for (int decade = 3; decade <= 8; ++decade) {
      const double tolerance = std::pow(10.0, -decade);
      const Made made = make(oscillator("0 .. 8, step 4, tolerance 1"),
                             {{"time", time}, {"tolerance", "1e-" + std::to_string(decade)}});
      EXPECT_LT(made.error, 60 * tolerance) << time << " " << tolerance;
      EXPECT_GT(made.error, 0.5 * tolerance) << time << " " << tolerance;
      const auto parts = static_cast<double>(made.result.parts);
      if (decade > 5) EXPECT_NEAR(std::log10(parts / before), 1.0 / order, 0.12) << time << " " << tolerance;
      before = parts;
    }
  }
}

/// A wave on a ring whose difference equation has a solution in closed form.
TEST(StepControl, OfAdvectionAndDiffusion) {
  const std::string text = R"(
model m { field u; param a, nu; dt(u) = -advect(a, u) + nu*lap(u) }
scheme c { time = bs32 }
scene s : m with c {
  grid x = 0 .. 2*pi, cells 16, periodic
  a = 1
  nu = 0.1
  initial u = sin(x)
  exact u = exp(-0.4*sin(pi/16)^2*(8/pi)^2*t)*sin(x - sin(pi/8)*8/pi*t)
  time 0 .. 1, step 1/2, tolerance 1e-4
}
)";
  const double coarse = make(text).error, fine = make(text, {{"tolerance", "1e-7"}}).error;
  EXPECT_LT(coarse, 3e-4);
  EXPECT_LT(fine, 3e-7);
  EXPECT_GT(fine, 1e-9);
}

TEST(StepControl, WhatIsTooLongIsMadeAgainShorter) {
  const RunResult whole = make(oscillator("0 .. 8, step 8, tolerance 1e-6")).result;
  EXPECT_GE(whole.refused, 2);
  const RunResult first = make(oscillator("0 .. 8, step 8, tolerance 1e-6, first 1e-2")).result;
  EXPECT_EQ(first.refused, 0);
  EXPECT_EQ(make(oscillator("0 .. 8, step 8, tolerance 1e3")).result.parts, 1);
  const double error = make(oscillator("0 .. 8, step 8, tolerance 1e-9, absolute 1e-3")).error;
  EXPECT_LT(error, 1e-2);
  EXPECT_GT(error, 1e-6);
}

/// du/dt = u^2 is infinite at t = 2; another one is not finite from the start; a jump needs short parts, once.
TEST(StepControl, EndsWithAMessageWhereNoPartIsShortEnough) {
  const auto text = [](const char* rate, const char* end) {
    return std::string("model m { field u; dt(u) = ") + rate +
           " }\nscheme c { time = dopri5 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 2, periodic\n  initial u = "
           "1/2\n  time 0 .. " +
           end + ", step 1, tolerance 1e-6\n}\n";
  };
  EXPECT_NEAR(make(text("u^2", "1")).u[0], 1, 1e-5);
  EXPECT_THROW(make(text("u^2", "3")), Error);
  EXPECT_THROW(make(text("sqrt(-1 - u)", "1")), Error);
  EXPECT_NEAR(make(text("if(t < 1/3, 0, 1)", "1")).u[0], 0.5 + 2. / 3, 2e-5);
}

TEST(StepControl, EventsAndControlsStayOnWholeSteps) {
  const auto end = [](const std::string& rest) {
    const std::string text = R"(
model m { field u; control F; dt(u) = F }
scheme c { time = bs32 }
scene s : m with c {
  grid x = 0 .. 1, cells 2, periodic
  F = if(t < 1/2, 1, 3) every 1/8
  initial u = 0
  time 0 .. 1, step 1/8, tolerance 1e-9, first 0.01
  )" + rest + "\n}\n";
    return make(text).u[1];
  };
  EXPECT_NEAR(end(""), 2, 1e-12);
  EXPECT_NEAR(end("every 1/4: u += 1"), 6, 1e-12);
  EXPECT_NEAR(end("at t = 1/8, 1: u += 1"), 4, 1e-12);
  EXPECT_NEAR(end("every 1/8: u = 0"), 0, 1e-12);
}

TEST(StepControl, BackEndsAndThreadsAgree) {
  const std::string text =
      "model m { field u; param nu; dt(u) = -u*dx(u) + nu*lap(u) }\nscheme c { time = dopri5 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 12\n  grid y = 0 .. 1, cells 9, periodic\n"
      "  boundary u: x = 0\n  nu = 0.01\n  initial u = 0.1*sin(pi*x)*(2 + cos(2*pi*y))\n"
      "  time 0 .. 0.5, step 1/4, tolerance 1e-10\n}\n";
  const Made jit = make(text), threads = make(text, {}, driver::Backend::jit, 3);
  const Made interpreted = make(text, {}, driver::Backend::interpreter);
  EXPECT_EQ(jit.u, threads.u);
  EXPECT_EQ(jit.result.parts, interpreted.result.parts);
  EXPECT_GT(jit.result.parts, 4);
  for (std::size_t i = 0; i < jit.u.size(); ++i) EXPECT_NEAR(jit.u[i], interpreted.u[i], 1e-13);
}

std::string inverse_problem() {
  return R"(
model m {
  field u, v
  param nu
  control F
  dt(u) = -advect((u, v), u) + nu*lap(u) + F
  dt(v) = -advect((u, v), v) + nu*lap(v)
}
scheme c { time = bs32 }
scene s : m with c {
  grid x = 0 .. 1, cells 7
  grid y = 0 .. 1, cells 6, periodic
  boundary u: x.low = sin(t), x.high = zero_gradient
  boundary v = zero_gradient
  nu = 0.02
  F = sin(t) every 1/4
  initial u = 1 + sin(3*x + 2*pi*y)
  initial v = cos(x)
  time 0 .. 1, step 1/8, tolerance 1e-3
  every 1/4: v += 0.1*u*v
}
task t : s {
  unknown initial u
  unknown initial v
  unknown nu
  unknown F
  minimise mean(u^2 + v^3)
  minimise mean(u*v) + F^2 over time
}
)";
}

constexpr const char* flow = R"(
model m {
  vector u on faces
  field p
  param nu
  mask solid
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = 0 inside solid
}
scheme c { time = dopri5 }
scene s : m with c {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 5
  boundary u: y = (0, 0)
  nu = 0.02
  solid = (x - 0.5)^2 + (y - 0.5)^2 < 0.03
  initial u.x = y*(1 - y)
  initial u.y = 0.1*sin(2*pi*x)
  time 0 .. 0.5, step 1/8, tolerance 1e-4
}
task t : s {
  unknown initial u
  unknown nu
  minimise mean(u.x^2) over time
  minimise mean(u.y^3) over time
}
)";

TEST(StepControl, DerivativesAreCertified) {
  expect_certified(inverse_problem(), true);
  expect_certified(flow, false);
}

/// Bit-identical for any number of checkpoints and threads, though parts are made again.
TEST(StepControl, CheckpointsAndThreadsChangeNothing) {
  const SourceFile source("test.dpde", inverse_problem());
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  const auto code = compiled(source, options);
  std::vector<double> first;
  for (const auto& [slots, threads] : {std::pair{0, 1}, {1, 1}, {2, 1}, {3, 3}, {8, 1}}) {
    DiagnosticSink sink;
    driver::SessionOptions with;
    with.slots = slots;
    with.threads = threads;
    const auto session = driver::Session::open(source, code, with, sink);
    ASSERT_TRUE(session);
    const GradientResult& result = session->rollout().gradient();
    std::vector<double> values = result.param_bars;
    values.resize(values.size() + 42);
    copy_out(result.state_bars[0], std::span(values).last(42));
    if (first.empty()) first = values;
    EXPECT_EQ(values, first) << slots;
  }
}

/// A run that is broken off and goes on ends with the same bits; steps by hand are those of a run.
TEST(StepControl, GoesOnWhereItWas) {
  const SourceFile source("test.dpde", oscillator("0 .. 8, step 1/2, tolerance 1e-7"));
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.name = "s";
  const auto code = compiled(source, options);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, code, {}, sink);
  ASSERT_TRUE(session);
  Rollout& rollout = session->rollout();
  std::vector<std::vector<double>> middle;
  StepController controller;
  rollout.run({5, [&](const Snapshot& snapshot) {
                 if (snapshot.step != 5) return;
                 controller = rollout.controller();
                 for (void* state : snapshot.states)
                   copy_out(session->workspace().layout(), state, middle.emplace_back(1));
               }});
  const std::vector<double> end = session->final_state(0);
  rollout.restart();
  rollout.advance(7);
  rollout.advance(9);
  EXPECT_EQ(end[0], value_at(session->workspace().layout(), rollout.present()[0], {0, 0, 0}));
  for (std::size_t s = 0; s < middle.size(); ++s) rollout.initial(static_cast<int>(s)).copy_in(middle[s]);
  rollout.set_controller(controller);
  rollout.run({}, 5);
  EXPECT_EQ(end, session->final_state(0));
}

}  // namespace
}  // namespace dpde::testing
