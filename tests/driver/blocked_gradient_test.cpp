// SPDX-License-Identifier: Apache-2.0
// Adjoints of several steps in one pass over memory equal those of single steps: fields bit for bit, sums up to
// rounding, for every integrator, number of axes, steps per block, threads and stored states. Ghost layers of the
// blocks that are one cell too narrow would change the gradient by less than differences can show (speed.md, 2e).
#include <gtest/gtest.h>

#include <cmath>

#include "driver/scene/session.h"
#include "driver_support.h"
#include "support/setting.h"

namespace dpde::driver {
namespace {

using testing::grid;

struct Case {
  std::string name, text;
  bool blocks = true;
};

std::string task(const std::string& model, const std::string& scheme, const std::string& scene,
                 const std::string& losses) {
  return model + "\nscheme s { " + scheme + " }\nscene go : m with s {\n" + scene +
         "time 0 .. 0.017, step 1e-3\n}\ntask t : go {\n" +
         "unknown initial u from 0\nunknown q from 1 + x\nunknown kappa from 0.01\n" + losses +
         "using gradient_descent(rate = 1), iterations 1\n}\n";
}

std::string mixing(const std::string& scheme, const std::string& axes,
                   const std::string& losses = "minimise mean(u^2) at t = 0.017\n") {
  const std::string model = "model m { field u; coefficient q; param kappa; dt(u) = kappa*lap(u) + q*t*u - u*dx(u) }";
  return task(model, scheme, axes + "kappa = 0.01\nq = 1 + x\ninitial u = 0\n", losses);
}

std::vector<Case> cases() {
  const std::string two =
      "model m { field u, v; coefficient q; param kappa; dt(u) = -u*dx(u) - v*dy(u) + q*kappa*lap(u); dt(v) = -u*dx(v) "
      "- v*dy(v) + kappa*lap(v) }";
  const std::string linear = "model m { field u; coefficient q; param kappa; dt(u) = lap(u) }";
  const std::string ends = "minimise mean(u^2) at t = 0.006, 0.017\n";
  return {
      {"euler", mixing("time = euler", grid("x", 21) + grid("y", 40))},
      {"rk2", mixing("time = rk2", grid("x", 21) + grid("y", 70), ends)},
      {"wide", mixing("time = euler; lap = central(4); dx = central(4)", grid("x", 21) + grid("y", 70))},
      {"ssp_rk3", mixing("time = ssp_rk3", grid("x", 21) + grid("y", 90))},
      {"rk4", mixing("time = rk4", grid("x", 21) + grid("y", 120))},
      {"strips", mixing("time = euler", grid("x", 1500) + grid("y", 40), ends)},
      {"strips_rk2", mixing("time = rk2; lap = central(4)", grid("x", 1700) + grid("y", 90))},
      {"two", task(two, "time = euler",
                   grid("x", 600) + grid("y", 40) + "kappa = 0.01\nq = 1 + x\ninitial u = 0\ninitial v = 0\n", ends)},
      {"control",
       task("model m { field u; control field F; coefficient q; param kappa; dt(u) = kappa*lap(u) + q*F*u + dx(F) }",
            "time = rk2",
            grid("x", 21) + grid("y", 70) + "kappa = 0.01\nq = 1 + x\nF = sin(x + 90*t) every 0.005\ninitial u = 0\n",
            ends + "unknown F\n")},
      {"one_sided",
       task("operator north(u) order 1 = u[0, +1] - u\noperator west(u) order 1 = u - u[-1, 0]\n"
            "model m { field u; coefficient q; param kappa; dt(u) = kappa*lap(u) + q*u*north(u) - t*west(u) }",
            "time = rk2", grid("x", 1500) + grid("y", 90) + "kappa = 0.01\nq = 1 + x\ninitial u = 0\n", ends)},
      {"3d", mixing("time = euler", grid("x", 9) + grid("y", 40) + grid("z", 40))},
      {"linear",
       "model m { field u; coefficient q; param kappa; dt(u) = q*lap(u) }\nscheme s { time = euler }\nscene go : m "
       "with s {\n" +
           grid("x", 21) + grid("y", 40) +
           "kappa = 1\nq = 1e-3\ninitial u = 0\ntime 0 .. 0.017, step 1e-3\n}\ntask t : go {\nunknown initial u from "
           "0\nminimise mean(u^2) at t = 0.017\n" +
           "using gradient_descent(rate = 1), iterations 1\n}\n"},
      {"walls", mixing("time = euler", grid("x", 21) + grid("y", 40, false) + "boundary u: y = 0\n"), false},
      {"often", mixing("time = euler", grid("x", 21) + grid("y", 40), "minimise mean(u^2) over time\n"), false},
      {"tiny", mixing("time = euler", grid("x", 3) + grid("y", 2)), false},
  };
}

struct Found {
  double loss = 0;
  std::vector<double> bars;    // of states and unknown fields
  std::vector<double> params;  // of parameters
  int64_t stored = 0;
  int block = 1;
};

/// The gradient from a separate rollout.
Found gradient_of(Session& session, int block_steps, int threads, int slots) {
  RolloutSetup setup = session.setup();
  setup.block_steps = block_steps;
  setup.team = threads;
  setup.slots = slots;
  const Compiled& compiled = session.compiled();
  setup.adjoint = compiled.adjoint_of(compiled.step_name());
  setup.sought = session.rollout().sought();
  const model::Task& task = *session.problem().task;
  LossTerm term;
  term.loss = compiled.program(task.name + "_loss_1");
  term.adjoint = compiled.adjoint_of(task.name + "_loss_1");
  term.at_steps = session.steps_of(task.losses[0].when);
  setup.losses.push_back(term);
  Rollout rollout(setup);
  session.engine().begin_other(rollout);
  for (int s = 0; s < rollout.state_count(); ++s) {
    std::vector<double> values(static_cast<size_t>(cell_count(setup.layout)));
    for (size_t i = 0; i < values.size(); ++i) values[i] = std::sin(1.0 + 13 * static_cast<double>(i) + s);
    rollout.initial(s).copy_in(values);
  }
  const GradientResult& result = rollout.gradient();
  Found found{result.loss, {}, result.param_bars, result.stored_states, rollout.gradient_block_steps()};
  for (const std::vector<FieldView>* views : {&result.state_bars, &result.field_bars}) {
    for (const FieldView& view : *views) {
      std::vector<double> values(static_cast<size_t>(cell_count(setup.layout)));
      copy_out(view, values);
      found.bars.insert(found.bars.end(), values.begin(), values.end());
    }
  }
  return found;
}

void expect_gradient_of_single_steps(const Case& example, Precision real) {
  SCOPED_TRACE(example.name);
  const SourceFile source("blocked.dpde", example.text);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  options.real = real;
  options.adjoint = true;
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << testing::all_messages(source, sink);
  const Found plain = gradient_of(*session, 1, 1, 0);
  for (const double value : plain.bars) ASSERT_TRUE(std::isfinite(value));
  EXPECT_EQ(plain.block, 1);
  for (const int steps : {2, 3, 5, 8}) {
    SCOPED_TRACE(std::to_string(steps) + " steps a block");
    const Found first = gradient_of(*session, steps, 1, 0);
    if (steps < 4 || !example.blocks) {
      EXPECT_EQ(first.block, example.blocks ? steps : 1);  // longer blocks may not fit the grid
    }
    EXPECT_EQ(first.loss, plain.loss);
    EXPECT_EQ(first.bars, plain.bars);
    ASSERT_EQ(first.params.size(), plain.params.size());
    for (size_t p = 0; p < plain.params.size(); ++p)
      EXPECT_NEAR(first.params[p], plain.params[p],
                  (real == Precision::f64 ? 1e-13 : 1e-6) * std::abs(plain.params[p]));
    EXPECT_TRUE(first.block == 1 || plain.stored == 0 || first.stored < plain.stored);
    for (const auto& [threads, slots] : {std::pair(2, 0), std::pair(3, 2), std::pair(1, 1)}) {
      const Found other = gradient_of(*session, steps, threads, slots);
      EXPECT_EQ(other.bars, plain.bars) << threads << " threads, " << slots << " slots";
      EXPECT_EQ(other.params, first.params) << threads << " threads, " << slots << " slots";
    }
  }
}

/// The automatic choice, and so the sums, must not depend on the number of threads.
TEST(BlockedGradient, IsTheSameForEveryNumberOfThreads) {
  const std::string text = mixing("time = euler", grid("x", 4096) + grid("y", 160));
  const SourceFile source("threads.dpde", text);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  options.adjoint = true;
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << testing::all_messages(source, sink);
  const Found one = gradient_of(*session, 0, 1, 0);
  EXPECT_GT(one.block, 1);
  const Found single = gradient_of(*session, 1, 1, 0);
  EXPECT_EQ(single.block, 1);
  for (const int threads : {2, 5, 40}) {
    const Found steps = gradient_of(*session, 1, threads, 0);
    EXPECT_EQ(steps.bars, single.bars) << threads;
    EXPECT_EQ(steps.params, single.params) << threads;
    const Found other = gradient_of(*session, 0, threads, 0);
    EXPECT_EQ(other.block, one.block) << threads;
    EXPECT_EQ(other.stored, one.stored) << threads;
    EXPECT_EQ(other.bars, one.bars) << threads;
    EXPECT_EQ(other.params, one.params) << threads;
  }
}

TEST(BlockedGradient, IsThatOfSingleSteps) {
  for (const Case& example : cases()) expect_gradient_of_single_steps(example, Precision::f64);
}

TEST(BlockedGradient, IsThatOfSingleStepsInSinglePrecision) {
  std::size_t count = 0;
  for (const Case& example : cases()) {
    if (testing::is_tried(count++, 3)) expect_gradient_of_single_steps(example, Precision::f32);
  }
}

}  // namespace
}  // namespace dpde::driver
