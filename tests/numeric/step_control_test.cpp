// SPDX-License-Identifier: Apache-2.0
// Embedded pairs: orders, errors against tolerances, accepted, rejected and recorded substeps, gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "../driver/driver_support.h"
#include "dpde/runtime/error.h"
#include "support/flow_texts.h"
#include "support/opened_scene.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// u(t) = exp(sin(t)), and v(t) = sin(t) from an oscillator.
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

/// A run of scene s of the text.
Made make(const std::string& text, const Overrides& set = {}, driver::Backend backend = driver::Backend::jit,
          int threads = 1) {
  OpenWith with{.overrides = set, .backend = backend};
  with.session.threads = threads;
  const OpenedScene opened(text, "s", with);
  const auto& session = opened.session;
  Made made;
  if (!session) return made;
  made.result = session->rollout().run();
  made.u = session->final_state(0);
  const auto errors = session->errors(session->end_time(), session->rollout().final_states());
  for (const driver::ErrorNorms& of_field : errors) made.error = std::max(made.error, of_field.linf);
  return made;
}

struct Pair {
  const char* time;
  int order;
  const char* implicit = "linear";
  Overrides with(Overrides more) const {
    more.insert({{"time", time}, {"implicit", implicit}});
    return more;
  }
};
constexpr Pair pairs[] = {{"bs32", 3}, {"dopri5", 5}, {"ars443", 3, "all"}};

TEST(StepControl, ThePairsHaveTheirOrders) {
  for (const Pair& pair : pairs) {
    const auto& [time, order, implicit] = pair;
    const auto error = [&](const char* step) {
      return make(oscillator("0 .. 2, step 1"), pair.with({{"step", step}})).error;
    };
    const double coarse = error(order == 3 ? "1/4" : "1/16"), fine = error(order == 3 ? "1/8" : "1/32");
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.35) << time;
    EXPECT_LT(fine, order == 3 ? 1e-3 : 1e-10) << time;
  }
}

/// The error at the end is 0.5 to 60 times the tolerance over six decades; from 1e-5 on substeps grow as
/// tolerance^(-1/order).
TEST(StepControl, TheErrorFollowsTheTolerance) {
  for (const Pair& pair : pairs) {
    const auto& [time, order, implicit] = pair;
    double before = 0;
    for (int decade = 3; decade <= 8; ++decade) {
      const double tolerance = std::pow(10.0, -decade);
      const Made made =
          make(oscillator("0 .. 8, step 4, tolerance 1"), pair.with({{"tolerance", "1e-" + std::to_string(decade)}}));
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
  for (const char* time : {"bs32", "ars443"}) {  // the second is implicit in diffusion only
    const double coarse = make(text, {{"time", time}}).error,
                 fine = make(text, {{"time", time}, {"tolerance", "1e-7"}}).error;
    EXPECT_LT(coarse, 3e-4) << time;
    EXPECT_LT(fine, 3e-7) << time;
    EXPECT_GT(fine, 1e-9) << time;
  }
}

/// u = cos(t) + exp(-stiff*t) (Prothero and Robinson 1974): after the second term has decayed, substeps are about as
/// long as the first term allows, however stiff the equation (order reduction costs a factor of three). The error
/// estimate is damped like the result.
TEST(StepControl, WhatIsStiffDoesNotLimitPartsThatSolveForIt) {
  const std::string text = R"(
model m { field u; param stiff; dt(u) = -stiff*(u - cos(t)) - sin(t) }
scheme c { time = ars443; implicit = all }
scene s : m with c {
  grid x = 0 .. 1, cells 1, periodic
  stiff = 10
  initial u = 2
  exact u = cos(t) + exp(-stiff*t)
  time 0 .. 4, step 1, tolerance 1e-5
}
)";
  const Made mild = make(text);
  for (const char* stiff : {"1e3", "1e5", "1e7"}) {
    const Made made = make(text, {{"stiff", stiff}});
    EXPECT_LT(made.error, 1e-5) << stiff;
    EXPECT_LT(made.result.parts, 4 * mild.result.parts) << stiff;
  }
  EXPECT_GT(make(text, {{"stiff", "1e5"}, {"time", "dopri5"}, {"implicit", "linear"}}).result.parts,
            1000 * mild.result.parts);
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

/// du/dt = u^2 becomes infinite at t = 2; another case is not finite from the start; a jump needs short substeps once.
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
  EXPECT_NEAR(end("after step: u += 1"), 10, 1e-12);
}

/// If an event acted after substeps, whose number and length follow the tolerance, results would depend on the
/// tolerance, and the gradient would lack the effect of their lengths: here up to a third of it.
TEST(StepControl, WhatComesBehindStepsIsNoMatterOfTheTolerance) {
  for (std::size_t count = 0; const char* time : {"bs32", "dopri5", "ars443"}) {
    for (const char* event :
         {"u += 0.2*u^2", "u += push(u)", "u = u/sqrt(mean(u^2))", "u = max(u, 0.9)", "u += 0.1*k, v += u"}) {
      if (!is_tried(count++, 4)) continue;
      const auto text = [&](double k) {
        return fmt::format(
            "network push(u) {{ real f64; initial xavier, seed 3; dense 4; tanh; dense out }}\n"
            "model m {{ field u, v; param k; dt(u) = -k*u + 0.05*lap(u) + 0*push(u); dt(v) = u - v }}\n"
            "scheme c {{ time = {} }}\nscene s : m with c {{\n  grid x = 0 .. 1, cells 6, periodic\n  k = {:.17g}\n"
            "  initial u = 1 + 0.3*sin(2*pi*x)\n  initial v = 0\n  after step: {}\n"
            "  time 0 .. 1, step 1/4, tolerance 1e-4\n}}\n"
            "task t : s {{ unknown k; minimise mean(u^2) + mean(v), mean over time }}\n",
            time, k, event);
      };
      const Overrides tight{{"tolerance", "1e-9"}};
      EXPECT_NEAR(task_loss(text(1.3), "t"), task_loss(text(1.3), "t", tight), 2e-3) << time << " " << event;
      constexpr double h = 1e-4;
      const double by_secant = (task_loss(text(1.3 + h), "t", tight) - task_loss(text(1.3 - h), "t", tight)) / (2 * h);
      EXPECT_NEAR(task_gradient(text(1.3), "t", tight).gradient.at("k").front(), by_secant, 1e-5) << time << event;
    }
  }
}

TEST(StepControl, BackEndsAndThreadsAgree) {
  const std::string text =
      "model m { field u; param nu; dt(u) = -u*dx(u) + nu*lap(u) }\nscheme c { time = dopri5 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 12\n  grid y = 0 .. 1, cells 9, periodic\n"
      "  boundary u: x = 0\n  nu = 0.01\n  initial u = 0.1*sin(pi*x)*(2 + cos(2*pi*y))\n"
      "  time 0 .. 0.5, step 1/4, tolerance 1e-10\n}\n";
  for (const Overrides& set : {Overrides{}, {{"time", "ars443"}, {"tolerance", "1e-6"}}}) {
    const Made jit = make(text, set), threads = make(text, set, driver::Backend::jit, 3);
    const Made interpreted = make(text, set, driver::Backend::interpreter);
    EXPECT_EQ(jit.u, threads.u);
    EXPECT_EQ(jit.result.parts, interpreted.result.parts);
    EXPECT_GT(jit.result.parts, 4);
    for (std::size_t i = 0; i < jit.u.size(); ++i) EXPECT_NEAR(jit.u[i], interpreted.u[i], 1e-12);
  }
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
  minimise mean(u*v) + F^2, mean over time
}
)";
}

/// One of three substances is fast; a mask fixes them in a part of the plane.
std::string reacting_with_tolerance(const char* time) {
  return std::string("scheme c { implicit = all; time = ") + time + R"( }
model m {
  field u, v, w
  param a, stiff
  mask solid
  dt(u) = 0.02*lap(u) + a - (w + 1)*u + v*u^2
  dt(v) = 0.02*lap(v) + w*u - v*u^2
  dt(w) = 0.02*lap(w) + stiff*(3 - w) - w*u
  u = 1 inside solid
}
scene s : m with c {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 3, periodic
  boundary u = zero_gradient
  boundary v = zero_gradient
  boundary w = zero_gradient
  a = 1.2
  stiff = 1e3
  solid = (x - 0.5)^2 + (y - 0.5)^2 < 0.05
  initial u = 1 + x
  initial v = 2 + sin(2*pi*y)
  initial w = 3
  time 0 .. 1, step 1/4, tolerance 1e-4
}
task t : s {
  unknown initial u
  unknown initial v
  unknown a
  unknown stiff
  minimise mean(u^2 + v^3) over time
  minimise mean(w^2*u)
}
)";
}

const std::string controlled_flow = flow_around_a_solid + std::string(R"(
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
)");

TEST(StepControl, DerivativesAreCertified) {
  expect_certified(inverse_problem(), true);
  expect_certified(controlled_flow, false);
  expect_certified(reacting_with_tolerance("ars443"), true);
  for (const char* implicit : {"linear", "all"}) {
    std::string solved = controlled_flow;
    solved.replace(solved.find("time = dopri5"), 13, std::string("time = ars443; implicit = ") + implicit);
    expect_certified(solved, false);
  }
}

/// Bit-identical for any number of checkpoints and threads, though substeps are recomputed.
TEST(StepControl, CheckpointsAndThreadsChangeNothing) {
  for (const char* time : {"bs32", "ars443"}) {
    std::vector<double> first;
    for (const auto& [slots, threads] : {std::pair{0, 1}, {1, 1}, {2, 1}, {3, 3}, {8, 1}}) {
      OpenWith with{.overrides = {{"time", time}}, .adjoint = true};
      with.session.slots = slots;
      with.session.threads = threads;
      const OpenedScene opened(inverse_problem(), "t", with);
      ASSERT_TRUE(opened.session);
      const GradientResult& result = opened.session->rollout().gradient();
      std::vector<double> values = result.param_bars;
      values.resize(values.size() + 42);
      copy_out(result.state_bars[0], std::span(values).last(42));
      if (first.empty()) first = values;
      EXPECT_EQ(values, first) << time << " " << slots;
    }
  }
}

/// An interrupted and continued run ends bit-identically; single steps equal those of a run.
TEST(StepControl, GoesOnWhereItWas) {
  const OpenedScene opened(oscillator("0 .. 8, step 1/2, tolerance 1e-7"), "s");
  const auto& session = opened.session;
  ASSERT_TRUE(session);
  Rollout& rollout = session->rollout();
  std::vector<std::vector<double>> middle;
  StepController controller;
  rollout.run({5, [&](const Snapshot& snapshot) {
                 if (snapshot.step != 5) return;
                 controller = rollout.controller();
                 middle = opened.states_of(snapshot);
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
