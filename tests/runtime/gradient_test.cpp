// SPDX-License-Identifier: Apache-2.0
// Gradients of rollouts of hand-written programs: against finite differences, and with against without checkpoints.
#include <gtest/gtest.h>

#include <cmath>

#include "allocations.h"
#include "dpde/runtime/checkpoint.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/executor.h"
#include "rollout_cases.h"

namespace dpde {
namespace {

using namespace test;

/// Compares with central differences of loss() in every cell of every state, and in the parameter, if there is one.
void expect_gradient_of_loss(Rollout& rollout, const dpde_layout& layout, const std::string& param, double value,
                             double tolerance) {
  const GradientResult& result = rollout.gradient();
  const double step = 1e-5;
  EXPECT_EQ(rollout.loss(), result.loss);
  const std::vector<double> param_bars = result.param_bars;
  std::vector<std::vector<double>> bars;
  for (int s = 0; s < rollout.state_count(); ++s) bars.push_back(bars_of(layout, result, static_cast<size_t>(s)));
  double largest = 0;
  for (int s = 0; s < rollout.state_count(); ++s) {
    for (int64_t i = 0; i < layout.cells[0]; ++i) {
      double& cell = rollout.initial(s).as<double>()[i];
      const double before = cell;
      cell = before + step;
      const double above = rollout.loss();
      cell = before - step;
      const double below = rollout.loss();
      cell = before;
      EXPECT_NEAR(bars[static_cast<size_t>(s)][static_cast<size_t>(i)], (above - below) / (2 * step), tolerance)
          << "state " << s << " cell " << i;
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

TEST(Gradient, GradientAgreesWithFiniteDifferences) {
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

TEST(Gradient, CheckpointsChangeNoBit) {
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

TEST(Gradient, ABudgetInBytesChoosesTheSlots) {
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

TEST(Gradient, GradientsAllocateNothing) {
  BurgersCase burgers;
  for (int slots : {3, 100}) {
    RolloutSetup setup = burgers.setup(12, {12}, {3, 5});
    setup.slots = slots;
    Rollout rollout(std::move(setup));
    rollout.initial(0).copy_in(random_values(cells, 1));
    const long before = allocations();
    for (int i = 0; i < 10; ++i) rollout.gradient();
    rollout.loss();
    EXPECT_EQ(allocations(), before);
  }
}

TEST(Gradient, ReductionsAllocateNothing) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{200, 30, 20}, {});
  Field u(layout), m(layout);
  for (const std::array<int32_t, 3> over : {std::array<int32_t, 3>{1, 1, 1}, {0, 1, 0}, {1, 0, 1}}) {
    TestProgram program("reduce", 3, {"u"}, {"m"});
    program.reduce(DPDE_MEAN, "u", "m", over);
    Executor executor(program.table(), layout, 2);
    executor.bind(0, u.base());
    executor.bind(1, m.base());
    executor.run();
    const long before = allocations();
    for (int i = 0; i < 10; ++i) executor.run();
    EXPECT_EQ(allocations(), before);
  }
}

TEST(Gradient, NoStepsAtAll) {
  BurgersCase burgers;
  Rollout rollout(burgers.setup(0, {0}, {}));
  rollout.initial(0).copy_in(random_values(cells, 1));
  EXPECT_EQ(rollout.run().steps_done, 0);
  expect_gradient_of_loss(rollout, burgers.layout, "", 0, 1e-8);
}

// Two states: the wave equation u_next = 2 u - v + c (u[-1] - 2 u + u[+1]), v_next = u. Its adjoint reads no state.

void wave_uniforms(const double* params, double* uniforms) { uniforms[0] = params[0]; }

/// streams: u[-1], u, u[+1], v, u_next, v_next
void wave_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) {
    s[4][i] = 2 * s[1][i] - s[3][i] + row->uniforms[0] * (s[0][i] - 2 * s[1][i] + s[2][i]);
    s[5][i] = s[1][i];
  }
}

/// streams: un[-1], un, un[+1], vn (seeds), u_bar, v_bar
void wave_adjoint_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
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
    adjoint.sweep(wave_adjoint_row,
                  {{"u_next_bar", -1}, {"u_next_bar"}, {"u_next_bar", 1}, {"v_next_bar"}, {"u_bar"}, {"v_bar"}},
                  {adjoint.fill_of("u_bar")});
    adjoint.swap("u_next_bar", "u_bar");
    adjoint.bars({"u", "u_next"});
    adjoint.swap("v_next_bar", "v_bar");
    adjoint.bars({"v", "v_next"});
    target.copy_in(random_values(cells, 77));
  }
  RolloutSetup setup(std::vector<int> at_steps) {
    RolloutSetup setup;
    setup.step = &step.table();
    setup.adjoint = &adjoint.table();
    setup.layout = layout;
    setup.steps = 15;
    setup.params = {{"c", 0.4}};
    setup.losses = {
        {&losses.loss.table(), &losses.loss_adjoint.table(), std::move(at_steps), 1, {{"target", {target.base()}}}}};
    return setup;
  }
};

TEST(Gradient, TwoStatesAndAnAdjointThatReadsNone) {
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

// u_next = (k + t) u, t the time at the start of the step: the gradient is a product.

void first_two_uniforms(const double* params, double* uniforms) {
  uniforms[0] = params[0];
  uniforms[1] = params[1];
}
void factor_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[1][i] = (row->uniforms[0] + row->uniforms[1]) * s[0][i];
}

TEST(Gradient, TheTimeGoesBackwardsInTheAdjoint) {
  TestProgram step("step", 1, {"u"}, {"u_next"}), adjoint("adjoint", 1, {"u_next_bar", "u"}, {"u_bar"});
  step.params({"k", "t"}, first_two_uniforms, 2);
  step.sweep(factor_row, {{"u"}, {"u_next"}});
  step.swap("u", "u_next");
  adjoint.params({"k", "t"}, first_two_uniforms, 2);
  adjoint.sweep(factor_row, {{"u_next_bar"}, {"u_bar"}});
  adjoint.swap("u_next_bar", "u_bar");
  adjoint.bars({"u", "u_next"});
  BurgersPrograms losses;
  Field zero(line());
  for (int slots : {1, 3, 10}) {
    RolloutSetup setup;
    setup.step = &step.table();
    setup.adjoint = &adjoint.table();
    setup.layout = line();
    setup.steps = 6;
    setup.t0 = 1;
    setup.dt = 0.25;
    setup.slots = slots;
    setup.params = {{"k", 0.5}};
    setup.losses = {{&losses.loss.table(), &losses.loss_adjoint.table(), {3, 6}, 1, {{"target", {zero.base()}}}}};
    Rollout rollout(std::move(setup));
    rollout.initial(0).fill(2);
    double at_3 = 1, at_6 = 1;
    for (int n = 0; n < 6; ++n) (n < 3 ? at_3 : at_6) *= 1.5 + 0.25 * n;
    at_6 *= at_3;
    for (double bar : bars_of(line(), rollout.gradient()))
      EXPECT_NEAR(bar, 2 * 2 * (at_3 * at_3 + at_6 * at_6), 1e-10 * bar);
  }
}

// 2-D, zero gradient at all sides, two kernels: l = sum of the four neighbours - 4 u; u_next = u + c l with a field c.
// The adjoint runs on the domain extended by one cell without terms of points outside the interior, and is folded.

constexpr dpde_boundary wall{test::zero_gradient, test::zero_gradient};

/// streams: u, u west, u east, u south, u north, l
void laplace_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[5][i] = s[1][i] + s[2][i] + s[3][i] + s[4][i] - 4 * s[0][i];
}
/// streams: u, c, l, u_next
void add_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[3][i] = s[0][i] + s[1][i] * s[2][i];
}
/// streams: seed at centre, west, east, south, north, then c at the same places, u_bar
void heat_adjoint_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  const auto inside = [&](int64_t x, int64_t y) {
    return x >= 0 && x < row->layout->cells[0] && y >= 0 && y < row->layout->cells[1];
  };
  for (int64_t i = 0; i < row->count; ++i) {
    const int64_t x = row->first + i, y = row->y;
    double bar = inside(x, y) ? s[0][i] * (1 - 4 * s[5][i]) : 0;
    if (inside(x - 1, y)) bar += s[1][i] * s[6][i];
    if (inside(x + 1, y)) bar += s[2][i] * s[7][i];
    if (inside(x, y - 1)) bar += s[3][i] * s[8][i];
    if (inside(x, y + 1)) bar += s[4][i] * s[9][i];
    s[10][i] = bar;
  }
}

TEST(Gradient, TwoDimensionsWithWallsTemporariesAndACoefficient) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{5, 4}, {2, 2, 0});
  TestProgram step("step", 2, {"u", "c"}, {"l", "u_next"}), adjoint("adjoint", 2, {"u_next_bar", "c"}, {"u_bar"});
  TestProgram loss("loss", 2, {"u", "target"}), loss_adjoint("loss_adjoint", 2, {"u", "target"}, {"u_bar"});
  const std::array<dpde_boundary, 3> walls{wall, wall, wall};
  step.prepare(step.fill_of("u", walls));
  step.sweep(laplace_row, {{"u"}, {"u", -1}, {"u", 1}, {"u", 0, -1}, {"u", 0, 1}, {"l"}});
  step.sweep(add_row, {{"u"}, {"c"}, {"l"}, {"u_next"}}, {step.fill_of("u_next", walls)});
  step.swap("u", "u_next");
  std::vector<test::StreamOf> streams;
  for (const char* field : {"u_next_bar", "c"}) {
    streams.insert(streams.end(), {{field}, {field, -1}, {field, 1}, {field, 0, -1}, {field, 0, 1}});
  }
  streams.push_back({"u_bar"});
  adjoint.sweep(heat_adjoint_row, streams, {}, {}, {1, 1, 0});
  adjoint.fold(adjoint.fill_of("u_bar", walls), {1, 1, 0});
  adjoint.swap("u_next_bar", "u_bar");
  adjoint.bars({"u", "u_next"});
  loss.sums({"loss"});
  loss.sweep(test::square_row, {{"u"}, {"target"}}, {}, {"loss"});
  loss_adjoint.params({"loss_bar"}, test::loss_uniforms, 1);
  loss_adjoint.bars({"u"});
  loss_adjoint.bar_of_loss();
  loss_adjoint.sweep(test::square_adjoint_row, {{"u"}, {"target"}, {"u_bar"}});
  Field c(layout), target(layout);
  c.copy_in(random_values(20, 3));
  target.copy_in(random_values(20, 4));
  RolloutSetup setup;
  setup.step = &step.table();
  setup.adjoint = &adjoint.table();
  setup.layout = layout;
  setup.steps = 7;
  setup.fields = {{"c", c.base()}};
  setup.losses = {{&loss.table(), &loss_adjoint.table(), {4, 7}, 0.5, {{"target", {target.base()}}}}};
  for (int slots : {1, 2, 10}) {
    setup.slots = slots;
    Rollout rollout(setup);
    rollout.initial(0).copy_in(random_values(20, 5));
    const GradientResult& result = rollout.gradient();
    const std::vector<double> bars = bars_of(layout, result);
    for (int64_t i = 0; i < 20; ++i) {  // the loss is quadratic: central differences are exact
      double& cell = rollout.initial(0).as<double>()[index_of(layout, i % 5, i / 5, 0)];
      const double before = cell;
      cell = before + 0.5;
      const double above = rollout.loss();
      cell = before - 0.5;
      const double below = rollout.loss();
      cell = before;
      EXPECT_NEAR(bars[static_cast<size_t>(i)], above - below, 1e-10 * (std::abs(above) + std::abs(below)));
    }
  }
}

}  // namespace
}  // namespace dpde
