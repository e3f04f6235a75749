// SPDX-License-Identifier: Apache-2.0
// Rollouts of hand-written programs: gradients against finite differences, checkpoints against no checkpoints.
#include "dpde/runtime/rollout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>
#include <random>

#include "burgers_programs.h"
#include "dpde/runtime/checkpoint.h"
#include "dpde/runtime/error.h"

namespace {
long allocations = 0;
}
// Not inlined: g++ would see malloc in one place and delete in another and warn.
[[gnu::noinline]] void* operator new(size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace dpde {
namespace {

using test::BurgersPrograms;
using test::TestProgram;

constexpr int64_t cells = 16;

dpde_layout line(int64_t n = cells) { return make_layout(std::vector<int64_t>{n}, {1, 0, 0}); }

std::vector<double> random_values(int64_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(static_cast<size_t>(count));
  for (double& value : values) value = uniform(random);
  return values;
}

/// Burgers with losses against random data at several steps: term 0 has one target for all, term 1 one for each step.
struct BurgersCase {
  BurgersPrograms programs;
  dpde_layout layout = line();
  std::vector<Field> targets;

  BurgersCase() {
    for (int i = 0; i < 4; ++i) {
      targets.emplace_back(layout);
      targets.back().copy_in(random_values(cells, 100 + static_cast<uint64_t>(i)));
    }
  }
  RolloutSetup setup(int steps, std::vector<int> one, std::vector<int> each) {
    RolloutSetup setup;
    setup.step = &programs.step.table();
    setup.adjoint = &programs.adjoint.table();
    setup.layout = layout;
    setup.steps = steps;
    setup.dt = 0.05;
    setup.params = {{"hx", 0.5}, {"nu", 0.3}};
    const dpde_program *loss = &programs.loss.table(), *adjoint = &programs.loss_adjoint.table();
    if (!one.empty()) setup.losses.push_back({loss, adjoint, one, 0.7, {{"target", {targets[0].base()}}}});
    if (!each.empty()) {
      LossData data{"target", {}};
      for (size_t i = 0; i < each.size(); ++i) data.at.push_back(targets[1 + i % 3].base());
      setup.losses.push_back({loss, adjoint, each, 1.3, {data}});
    }
    return setup;
  }
};

std::vector<double> bars_of(const dpde_layout& layout, const GradientResult& result, size_t state = 0) {
  std::vector<double> dense(static_cast<size_t>(cell_count(layout)));
  copy_out(layout, result.state_bars[state], dense);
  return dense;
}

/// Central differences of loss() in every cell of every state and in the parameter, if there is one.
void expect_gradient_of_loss(Rollout& rollout, const dpde_layout& layout, const std::string& param, double value, double tolerance) {
  const GradientResult& result = rollout.gradient();
  const double step = 1e-5;
  EXPECT_EQ(rollout.loss(), result.loss);
  const std::vector<double> param_bars = result.param_bars;
  std::vector<std::vector<double>> bars;
  for (int s = 0; s < rollout.state_count(); ++s) bars.push_back(bars_of(layout, result, static_cast<size_t>(s)));
  double largest = 0;
  for (int s = 0; s < rollout.state_count(); ++s) {
    for (int64_t i = 0; i < layout.cells[0]; ++i) {
      double& cell = rollout.initial(s).at(i);
      const double before = cell;
      cell = before + step;
      const double above = rollout.loss();
      cell = before - step;
      const double below = rollout.loss();
      cell = before;
      EXPECT_NEAR(bars[static_cast<size_t>(s)][static_cast<size_t>(i)], (above - below) / (2 * step), tolerance) << "state " << s << " cell " << i;
      largest = std::max(largest, std::abs(bars[static_cast<size_t>(s)][static_cast<size_t>(i)]));
    }
  }
  EXPECT_GT(largest, 1e-3);
  if (param.empty()) return;
  EXPECT_TRUE(rollout.set_param(param, value + step));
  const double above = rollout.loss();
  rollout.set_param(param, value - step);
  const double below = rollout.loss();
  rollout.set_param(param, value);
  ASSERT_EQ(rollout.param_bar_names(), std::vector<std::string>{param});
  EXPECT_NEAR(param_bars[0], (above - below) / (2 * step), tolerance * (1 + std::abs(param_bars[0])));
}

TEST(Rollout, GradientAgreesWithFiniteDifferences) {
  BurgersCase burgers;
  struct Losses {
    std::vector<int> one, each;
  };
  for (const Losses& losses : {Losses{{12}, {}}, {{3, 7}, {}}, {{0, 12}, {0, 5, 12}}, {{1}, {4, 5, 6, 7}}, {{0}, {}}}) {
    for (int slots : {1, 3, 100}) {
      RolloutSetup setup = burgers.setup(12, losses.one, losses.each);
      setup.slots = slots;
      Rollout rollout(std::move(setup));
      rollout.initial(0).copy_in(random_values(cells, 1));
      expect_gradient_of_loss(rollout, burgers.layout, losses.one == std::vector{0} ? "" : "nu", 0.3, 1e-8);
    }
  }
}

TEST(Rollout, CheckpointsChangeNoBit) {
  BurgersCase burgers;
  std::mt19937 random(5);
  for (int steps = 1; steps <= 32; ++steps) {
    std::vector<int> some;
    for (int k = 0; k < steps; ++k) {
      if (random() % 3 == 0) some.push_back(k);
    }
    std::vector<double> stored_bars;
    double stored_loss = 0, stored_param = 0;
    for (int slots = 32; slots >= 1; --slots) {
      RolloutSetup setup = burgers.setup(steps, {steps}, some);
      setup.slots = slots;
      Rollout rollout(std::move(setup));
      rollout.initial(0).copy_in(random_values(cells, 9));
      const GradientResult& result = rollout.gradient();
      if (slots == 32) {
        EXPECT_EQ(result.recomputed_steps, 0);
        stored_bars = bars_of(burgers.layout, result);
        stored_loss = result.loss;
        stored_param = result.param_bars[0];
      }
      ASSERT_EQ(bars_of(burgers.layout, result), stored_bars) << steps << " steps, " << slots << " slots";
      ASSERT_EQ(result.loss, stored_loss);
      ASSERT_EQ(result.param_bars[0], stored_param);
      ASSERT_EQ(result.stored_states, std::min(slots, std::max(steps - 1, 1)) - 1);
      ASSERT_EQ(result.recomputed_steps, checkpoint::advanced_steps(steps, slots) + 1 - steps);
      rollout.gradient();
      ASSERT_EQ(bars_of(burgers.layout, result), stored_bars) << "second call";
    }
  }
}

TEST(Rollout, ABudgetInBytesChoosesTheSlots) {
  BurgersCase burgers;
  RolloutSetup setup = burgers.setup(20, {20}, {});
  const int64_t state = field_bytes(burgers.layout);
  setup.checkpoint_bytes = 6 * state;
  Rollout rollout(setup);
  EXPECT_EQ(rollout.gradient().stored_states, 3);
  EXPECT_EQ(rollout.gradient().checkpoint_bytes, 6 * state);
  setup.checkpoint_bytes = 2 * state;
  EXPECT_THROW(Rollout{setup}, Error);
}

TEST(Rollout, GradientsAllocateNothing) {
  BurgersCase burgers;
  for (int slots : {3, 100}) {
    RolloutSetup setup = burgers.setup(12, {12}, {3, 5});
    setup.slots = slots;
    Rollout rollout(std::move(setup));
    rollout.initial(0).copy_in(random_values(cells, 1));
    const long before = allocations;
    for (int i = 0; i < 10; ++i) rollout.gradient();
    rollout.loss();
    EXPECT_EQ(allocations, before);
  }
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

TEST(Rollout, ThreadsChangeNoBit) {
  BurgersCase burgers;  // 1-D: one row, never on threads; the setting alone must change nothing
  std::vector<double> bars;
  for (int threads : {1, 2}) {
    RolloutSetup setup = burgers.setup(12, {12}, {});
    setup.threads = threads;
    Rollout rollout(std::move(setup));
    rollout.initial(0).copy_in(random_values(cells, 1));
    const std::vector<double> found = bars_of(burgers.layout, rollout.gradient());
    if (threads == 1) bars = found;
    EXPECT_EQ(found, bars);
  }
}

// Two states: the wave equation u_next = 2 u - v + c (u[-1] - 2 u + u[+1]), v_next = u. Its adjoint reads no state.

void wave_uniforms(const double* params, double* uniforms) { uniforms[0] = params[0]; }

/// streams: u[-1], u, u[+1], v, u_next, v_next
void wave_row(const dpde_row* row) {
  double* const* s = row->streams;
  for (int64_t i = 0; i < row->count; ++i) {
    s[4][i] = 2 * s[1][i] - s[3][i] + row->uniforms[0] * (s[0][i] - 2 * s[1][i] + s[2][i]);
    s[5][i] = s[1][i];
  }
}

/// streams: un[-1], un, un[+1], vn (seeds), u_bar, v_bar
void wave_adjoint_row(const dpde_row* row) {
  double* const* s = row->streams;
  for (int64_t i = 0; i < row->count; ++i) {
    s[4][i] = 2 * s[1][i] + row->uniforms[0] * (s[0][i] - 2 * s[1][i] + s[2][i]) + s[3][i];
    s[5][i] = -s[1][i];
  }
}

struct WaveCase {
  TestProgram step{"wave_step", 1, {"u", "v"}, {"u_next", "v_next"}};
  TestProgram adjoint{"wave_step_adjoint", 1, {"u_next_bar", "v_next_bar"}, {"u_bar", "v_bar"}};
  BurgersPrograms losses;
  dpde_layout layout = line();
  Field target{layout};

  WaveCase() {
    step.params({"c"}, wave_uniforms, 1);
    step.prepare(step.fill_of("u"));
    step.sweep(wave_row, {{"u", -1}, {"u"}, {"u", 1}, {"v"}, {"u_next"}, {"v_next"}}, {step.fill_of("u_next")});
    step.swap("u", "u_next");
    step.swap("v", "v_next");
    adjoint.params({"c"}, wave_uniforms, 1);
    adjoint.prepare(adjoint.fill_of("u_next_bar"));
    adjoint.sweep(wave_adjoint_row, {{"u_next_bar", -1}, {"u_next_bar"}, {"u_next_bar", 1}, {"v_next_bar"}, {"u_bar"}, {"v_bar"}},
                  {adjoint.fill_of("u_bar")});
    adjoint.swap("u_next_bar", "u_bar");
    adjoint.swap("v_next_bar", "v_bar");
    target.copy_in(random_values(cells, 77));
  }
  RolloutSetup setup(std::vector<int> at_steps) {
    RolloutSetup setup;
    setup.step = &step.table();
    setup.adjoint = &adjoint.table();
    setup.layout = layout;
    setup.steps = 15;
    setup.params = {{"c", 0.4}};
    setup.losses = {{&losses.loss.table(), &losses.loss_adjoint.table(), std::move(at_steps), 1, {{"target", {target.base()}}}}};
    return setup;
  }
};

TEST(Rollout, TwoStatesAndAnAdjointThatReadsNone) {
  WaveCase wave;
  for (const std::vector<int>& at_steps : std::vector<std::vector<int>>{{15}, {9}, {2, 11}, {0, 1, 15}}) {
    for (int slots : {1, 4, 100}) {
      RolloutSetup setup = wave.setup(at_steps);
      setup.slots = slots;
      Rollout rollout(std::move(setup));
      rollout.initial(rollout.state_index("u")).copy_in(random_values(cells, 1));
      rollout.initial(rollout.state_index("v")).copy_in(random_values(cells, 2));
      EXPECT_EQ(rollout.state_index("w"), -1);
      expect_gradient_of_loss(rollout, wave.layout, "", 0, 1e-7);
      if (at_steps.size() > 1) continue;
      EXPECT_EQ(rollout.gradient().stored_states, 0);
      EXPECT_EQ(rollout.gradient().recomputed_steps, 0);
    }
  }
}

// u_next = k u + t, t the time at the start of the step.

void growth_uniforms(const double* params, double* uniforms) {
  uniforms[0] = params[0];
  uniforms[1] = params[1];
}
void growth_row(const dpde_row* row) {
  for (int64_t i = 0; i < row->count; ++i) row->streams[1][i] = row->uniforms[0] * row->streams[0][i] + row->uniforms[1];
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
  EXPECT_EQ(rollout.final_states()[0][3], 2 + 2.5 + 3 + 3.5 + 4);
  EXPECT_EQ(rollout.initial(0).at(3), 0);  // untouched
}

TEST(Rollout, TheObserverSeesEveryKthStateAndTheLast) {
  GrowthCase growth;
  Rollout rollout(growth.setup(200, 1, 0));
  std::vector<int> steps;
  const auto look = [&](const Snapshot& at) {
    steps.push_back(at.step);
    EXPECT_EQ(at.t, 2);
    EXPECT_EQ(at.states[0][0], 2.0 * at.step);
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
    // u grows tenfold a step: 10^309 is not finite.
    Rollout rollout(growth.setup(300, 10, 0));
    RolloutSetup setup = growth.setup(300, 10, 0);
    setup.t0 = 0;
    rollout = Rollout(std::move(setup));
    rollout.initial(0).at(5) = std::pow(10.0, 308 - first + 1);
    rollout.initial(0).at(11) = 1e-30;
    const RunResult result = rollout.run();
    ASSERT_TRUE(result.blow_up);
    EXPECT_EQ(result.blow_up->step, first);
    EXPECT_EQ(result.blow_up->state, 0);
    EXPECT_EQ(result.blow_up->cell, (Cell{5, 0, 0}));
    EXPECT_TRUE(std::isinf(result.blow_up->value));
    EXPECT_EQ(result.steps_done, first - 1);
    EXPECT_TRUE(is_finite(growth.layout, rollout.final_states()[0]));
    EXPECT_GT(rollout.final_states()[0][5], 1e307);
  }
}

TEST(Rollout, ABadInitialStateIsStateZero) {
  GrowthCase growth;
  Rollout rollout(growth.setup(10, 1, 0));
  rollout.initial(0).at(2) = std::nan("");
  const RunResult result = rollout.run();
  ASSERT_TRUE(result.blow_up);
  EXPECT_EQ(result.blow_up->step, 0);
  EXPECT_EQ(result.blow_up->cell, (Cell{2, 0, 0}));
}

TEST(Rollout, NoStepsAtAll) {
  BurgersCase burgers;
  Rollout rollout(burgers.setup(0, {0}, {}));
  rollout.initial(0).copy_in(random_values(cells, 1));
  EXPECT_EQ(rollout.run().steps_done, 0);
  expect_gradient_of_loss(rollout, burgers.layout, "", 0, 1e-8);
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
