// SPDX-License-Identifier: Apache-2.0
// Forward runs: time, observers, stops, blow-ups, and messages about missing inputs.
#include "dpde/runtime/rollout.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dpde/runtime/error.h"
#include "rollout_cases.h"

namespace dpde {
namespace {

using namespace test;

// u_next = k u + t, t the time at the start of the step.

void growth_uniforms(const double* params, double* uniforms) {
  uniforms[0] = params[0];
  uniforms[1] = params[1];
}
void growth_row(const dpde_row* row) {
  const Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[1][i] = row->uniforms[0] * s[0][i] + row->uniforms[1];
}

struct GrowthCase {
  TestProgram step{"growth_step", 1, {"u"}, {"u_next"}};
  dpde_layout layout = line();
  GrowthCase() {
    step.params({"k", "t"}, growth_uniforms, 2);
    step.sweep(growth_row, {{"u"}, {"u_next"}});
    step.swap("u", "u_next");
  }
  RolloutSetup setup(int steps, double k, double dt) {
    RolloutSetup setup;
    setup.step = &step.table();
    setup.layout = layout;
    setup.steps = steps;
    setup.t0 = 2;
    setup.dt = dt;
    setup.params = {{"k", k}};
    return setup;
  }
};

TEST(Rollout, TheTimeIsThatOfTheStepsStart) {
  GrowthCase growth;
  Rollout rollout(growth.setup(5, 1, 0.5));
  const RunResult result = rollout.run();
  EXPECT_EQ(result.steps_done, 5);
  EXPECT_FALSE(result.blow_up);
  EXPECT_EQ(Doubles{rollout.final_states().data()}[0][3], 2 + 2.5 + 3 + 3.5 + 4);
  EXPECT_EQ(rollout.initial(0).at(3), 0);  // unchanged
}

TEST(Rollout, TheObserverSeesEveryKthStateAndTheLast) {
  GrowthCase growth;
  Rollout rollout(growth.setup(200, 1, 0));
  std::vector<int> steps;
  const auto look = [&](const Snapshot& at) {
    steps.push_back(at.step);
    EXPECT_EQ(at.t, 2);
    EXPECT_EQ(Doubles{at.states.data()}[0][0], 2.0 * at.step);
  };
  rollout.run({70, look});
  EXPECT_EQ(steps, (std::vector{0, 70, 140, 200}));
  steps.clear();
  rollout.run({100, look});
  EXPECT_EQ(steps, (std::vector{0, 100, 200}));
  steps.clear();
  rollout.run({0, look});
  EXPECT_TRUE(steps.empty());
}

TEST(Rollout, FindsWhereTheFirstValueBlowsUp) {
  GrowthCase growth;
  for (int first : {1, 63, 64, 65, 128, 200, 300}) {
    // u grows tenfold per step: 10^309 is not finite.
    Rollout rollout(growth.setup(300, 10, 0));
    RolloutSetup setup = growth.setup(300, 10, 0);
    setup.t0 = 0;
    rollout = Rollout(std::move(setup));
    rollout.initial(0).set(std::pow(10.0, 308 - first + 1), 5);
    rollout.initial(0).set(1e-30, 11);
    const RunResult result = rollout.run();
    ASSERT_TRUE(result.blow_up);
    EXPECT_EQ(result.blow_up->step, first);
    EXPECT_EQ(result.blow_up->state, 0);
    EXPECT_EQ(result.blow_up->cell, (Cell{5, 0, 0}));
    EXPECT_TRUE(std::isinf(result.blow_up->value));
    EXPECT_EQ(result.steps_done, first - 1);
    EXPECT_TRUE(is_finite(growth.layout, rollout.final_states()[0]));
    EXPECT_GT(Doubles{rollout.final_states().data()}[0][5], 1e307);
  }
}

TEST(Rollout, ABadInitialStateIsStateZero) {
  GrowthCase growth;
  Rollout rollout(growth.setup(10, 1, 0));
  rollout.initial(0).set(std::nan(""), 2);
  const RunResult result = rollout.run();
  ASSERT_TRUE(result.blow_up);
  EXPECT_EQ(result.blow_up->step, 0);
  EXPECT_EQ(result.blow_up->cell, (Cell{2, 0, 0}));
}

TEST(Rollout, AStopEndsTheGradient) {
  BurgersCase burgers;
  std::atomic<bool> stop = false;
  RolloutSetup setup = burgers.setup(12, {12}, {});
  setup.stop = &stop;
  Rollout rollout(std::move(setup));
  EXPECT_FALSE(rollout.gradient().stopped);
  stop = true;
  EXPECT_TRUE(rollout.gradient().stopped);
  EXPECT_TRUE(std::isnan(rollout.loss()));
  const RunResult run = rollout.run();
  EXPECT_TRUE(run.stopped);
  EXPECT_EQ(run.steps_done, 0);
  stop = false;
  EXPECT_FALSE(rollout.gradient().stopped);
}

TEST(Rollout, SaysWhatIsMissing) {
  BurgersCase burgers;
  const auto message = [](const RolloutSetup& setup) -> std::string {
    try {
      Rollout rollout(setup);
      rollout.gradient();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const RolloutSetup good = burgers.setup(4, {4}, {});
  EXPECT_EQ(message(good), "");
  RolloutSetup bad = good;
  bad.params.pop_back();
  EXPECT_EQ(message(bad), "program burgers_step: parameter nu is not bound");
  bad = good;
  bad.losses[0].data.clear();
  EXPECT_EQ(message(bad), "program loss: field target is not bound");
  bad = good;
  bad.losses[0].at_steps = {5};
  EXPECT_EQ(message(bad), "a loss at step 5 of a run of 4 steps");
  bad = good;
  bad.losses[0].at_steps = {2, 2};
  EXPECT_EQ(message(bad), "the steps of a loss are not increasing at 2");
  bad = good;
  bad.steps = -1;
  EXPECT_EQ(message(bad), "the number of steps is -1; it must not be negative");
  bad = good;
  bad.adjoint = nullptr;
  EXPECT_EQ(message(bad), "the gradient needs the adjoint of the step");
  bad = good;
  bad.losses[0].adjoint = nullptr;
  EXPECT_EQ(message(bad), "the gradient needs the adjoint of the loss loss");
}

}  // namespace
}  // namespace dpde
