// SPDX-License-Identifier: Apache-2.0
// Generated code beside hand-written code in one run: JIT and compiled C++ of 2-D Burgers (step and adjoint step) and
// 3-D heat, the gradient of 1-D Burgers (128 cells, 32 steps), and the time from text to callable programs. Ratios are
// between rows of the same size (rows _f32 beside those in f64): run with --benchmark_repetitions=9 and compare
// medians.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "generated.h"
#include "handwritten.h"

namespace dpde::bench {
namespace {

/// 2-D Burgers with one of the time schemes.
std::string burgers_2d_with(const std::string& time) {
  return R"(
model burgers { field u, v; param nu
  dt(u) = -advect((u, v), u) + nu*lap(u)
  dt(v) = -advect((u, v), v) + nu*lap(v) }
scheme plain { time = )" +
         time + R"( }
scene s : burgers with plain {
  grid x = 0 .. 1, cells 64, periodic
  grid y = 0 .. 1, cells 64, periodic
  nu = 0.001
  initial u = sin(2*pi*x)
  initial v = cos(2*pi*y)
  time 0 .. 1e-3, step 1e-4
})";
}
const std::string burgers_2d = burgers_2d_with("euler"), burgers_2d_rk4 = burgers_2d_with("rk4");
const std::string burgers_2d_task = burgers_2d + R"(
task t : s {
  unknown initial u
  unknown initial v
  minimise mean(u^2 + v^2) at t = 1e-3
})";

std::string heat_on(const std::string& axes) {
  std::string text = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) }
scheme plain { time = euler }
scene s : heat with plain {
)";
  for (const char axis : axes) text += std::string("  grid ") + axis + " = 0 .. 1, cells 64, periodic\n";
  return text + "  kappa = 1\n  initial u = sin(2*pi*x)\n  time 0 .. 1e-5, step 1e-6\n}";
}
const std::string heat_2d = heat_on("xy"), heat_3d = heat_on("xyz");

const std::string wave_3d = wave_of("param", "time 0 .. 1e-2, step 1e-3");

const std::string heat_3d_task = heat_3d + "\ntask t : s {\n  unknown initial u\n  minimise mean(u^2) at t = 1e-5\n}";
const std::string wave_3d_task = wave_3d + "\ntask t : s {\n  unknown initial u\n  minimise mean(u^2) at t = 1e-2\n}";

const std::string burgers_1d = R"(
model burgers { field u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
scheme plain { time = euler }
scene s : burgers with plain {
  grid x = -1 .. 1, cells 128, periodic
  nu = 0.01
  initial u = -sin(pi*x)
  time 0 .. 0.32, step 0.01
}
task t : s {
  unknown initial u
  minimise sum((u - 1)^2) at t = 0.32
})";

constexpr handwritten::Burgers weights{0.005, 0.01};

void burgers_2d_step(benchmark::State& state, Code code) {
  const dpde_layout layout = square(state.range(0), code);
  if (code != hand) return run_generated(state, burgers_2d, code, false, layout);
  std::vector<Field> f = make_fields(layout, 4);
  double* p[4] = {f[0].as<double>(), f[1].as<double>(), f[2].as<double>(), f[3].as<double>()};
  for (auto _ : state) {
    handwritten::burgers2d_step(layout, {p[0], p[1]}, {p[2], p[3]}, weights);
    std::swap(p[0], p[2]);
    std::swap(p[1], p[3]);
  }
  count(state, layout);
}

void burgers_2d_adjoint(benchmark::State& state, Code code) {
  const dpde_layout layout = square(state.range(0), code);
  if (code != hand) return run_generated(state, burgers_2d, code, true, layout);
  std::vector<Field> f = make_fields(layout, 6);
  double* p[4] = {f[0].as<double>(), f[1].as<double>(), f[2].as<double>(), f[3].as<double>()};
  for (auto _ : state) {
    handwritten::burgers2d_adjoint(layout, {f[4].as<double>(), f[5].as<double>()}, {p[0], p[1]}, {p[2], p[3]}, weights);
    std::swap(p[0], p[2]);
    std::swap(p[1], p[3]);
  }
  count(state, layout);
}

void heat_2d_step(benchmark::State& state, Code code) {
  run_generated(state, heat_2d, code, false, square(state.range(0), code));
}

void heat_3d_step(benchmark::State& state, Code code) {
  const dpde_layout layout = cube(state.range(0), code);
  if (code != hand) return run_generated(state, heat_3d, code, false, layout);
  std::vector<Field> f = make_fields(layout, 2);
  double *a = f[0].as<double>(), *b = f[1].as<double>();
  for (auto _ : state) {
    handwritten::heat3d_step(layout, a, b, 0.01, {.rows = layout.cells[1], .prefetch = false});
    std::swap(a, b);
  }
  count(state, layout);
}

void heat_3d_adjoint(benchmark::State& state, Code code) {
  run_generated(state, heat_3d, code, true, cube(state.range(0), code));
}

void burgers_1d_gradient(benchmark::State& state, Code code) {
  constexpr int steps = 32;
  if (code == hand) {
    const dpde_layout layout = make_layout(std::vector<int64_t>{128}, {1, 0, 0});
    std::vector<Field> f = make_fields(layout, 3);
    std::vector<double> memory(static_cast<size_t>(layout.size) * (steps + 2));
    double* trajectory = memory.data() + layout.origin;
    double* const bars[2] = {f[0].as<double>(), f[1].as<double>()};
    for (int i = 0; i < 128; ++i) trajectory[i] = -std::sin(std::numbers::pi * (i + 0.5) / 64);
    for (auto _ : state) {
      benchmark::DoNotOptimize(
          handwritten::burgers1d_gradient(layout, trajectory, steps, {0.32, 0.4}, f[2].as<double>(), bars));
    }
    return;
  }
  const SourceFile source("bench.dpde", burgers_1d);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compile(burgers_1d, code), {}, sink);
  const auto inverse = driver::Inverse::open(*session, source, sink);
  Eigen::VectorXd gradient(inverse->size());
  for (auto _ : state) benchmark::DoNotOptimize(inverse->value_and_gradient(inverse->start(), gradient));
}

/// 32 steps of the text's scene.
RolloutSetup steps_32(const driver::Compiled& compiled, int64_t n, int block_steps, int threads) {
  RolloutSetup setup;
  setup.step = compiled.program(compiled.step_name());
  setup.layout = setup.step->rank == 3
                     ? cube(n, jit, setup.step->halo[0])
                     : make_layout(std::vector<int64_t>{n, n}, {setup.step->halo[0], setup.step->halo[1], 0});
  setup.steps = 32;
  setup.dt = 1e-2;
  setup.team = threads;
  setup.block_steps = block_steps;
  for (int p = 0; p < setup.step->param_count; ++p)
    setup.params.push_back({setup.step->params[p], setup.step->params[p][0] == 'h' ? 1.0 : 1e-2});
  return setup;
}

void set_initial(Rollout& rollout, const dpde_layout& layout) {
  for (int s = 0; s < rollout.state_count(); ++s) {
    std::vector<double> values(static_cast<size_t>(cell_count(layout)));
    for (size_t i = 0; i < values.size(); ++i) values[i] = std::sin(0.001 * static_cast<double>(i) + s);
    rollout.initial(s).copy_in(values);
  }
}

/// A run of 32 steps: one by one (block_steps 1), or several in one pass over memory (0: as many as it chooses).
/// Compiled for a small grid the rows have no variants: sweeps with ordinary stores.
enum Rows { tuned, ordinary };
void rollout_32(benchmark::State& state, const std::string& text, int block_steps, Rows rows) {
  const auto compiled = compile(text, jit, rows == tuned ? state.range(0) : 64);
  const RolloutSetup setup = steps_32(*compiled, state.range(0), block_steps, 1);
  Rollout rollout(setup);
  set_initial(rollout, setup.layout);
  for (int n = 0; n < runs_to_tune; n += setup.steps) rollout.run();
  for (auto _ : state) benchmark::DoNotOptimize(rollout.run().steps_done);
  state.SetItemsProcessed(static_cast<int64_t>(state.iterations()) * cell_count(setup.layout) * setup.steps);
  state.counters["block"] = rollout.block_steps();
}

/// 32 RK4 steps with stage arrays and separate updates, by hand.
void rk4_separate_32(benchmark::State& state) {
  const dpde_layout layout = square(state.range(0));
  std::vector<Field> f = make_fields(layout, 12);
  const auto pair = [&](size_t i) {
    return handwritten::NextVelocity{f[2 * i].as<double>(), f[2 * i + 1].as<double>()};
  };
  const handwritten::NextVelocity k[4] = {pair(2), pair(3), pair(4), pair(5)};
  for (auto _ : state) {
    for (int n = 0; n < 32; ++n) handwritten::burgers2d_rk4_separate(layout, pair(0), pair(1), k, weights);
  }
  state.SetItemsProcessed(static_cast<int64_t>(state.iterations()) * cell_count(layout) * 32);
}

/// The gradient of a loss at the end of 32 steps, beside rollout_32 of the same size.
void gradient_32(benchmark::State& state, const std::string& text, int block_steps, int threads) {
  const auto compiled = compile(text, jit, state.range(0));
  RolloutSetup setup = steps_32(*compiled, state.range(0), block_steps, threads);
  setup.adjoint = compiled->adjoint_of(compiled->step_name());
  LossTerm term;
  term.loss = compiled->program("t_loss_1");
  term.adjoint = compiled->adjoint_of("t_loss_1");
  term.at_steps = {setup.steps};
  setup.losses = {term};
  for (const char* name : {"hx", "hy", "hz", "cells"}) setup.params.push_back({name, 1.0});
  Rollout rollout(setup);
  set_initial(rollout, setup.layout);
  for (int n = 0; n < runs_to_tune; n += setup.steps) rollout.gradient();
  for (auto _ : state) benchmark::DoNotOptimize(rollout.gradient().loss);
  state.SetItemsProcessed(static_cast<int64_t>(state.iterations()) * cell_count(setup.layout) * setup.steps);
  state.counters["block"] = rollout.gradient_block_steps();
  state.counters["MiB"] = static_cast<double>(rollout.gradient().checkpoint_bytes) / (1 << 20);
}

/// The same of 2-D Burgers by hand: all states are kept.
void gradient_32_by_hand(benchmark::State& state) {
  constexpr std::size_t steps = 32;
  const dpde_layout layout = square(state.range(0));
  std::vector<Field> states = make_fields(layout, 2 * (steps + 1)), bars = make_fields(layout, 4);
  const auto pair = [](std::vector<Field>& fields, std::size_t i) {
    return handwritten::NextVelocity{fields[2 * i].as<double>(), fields[2 * i + 1].as<double>()};
  };
  const auto read = [](const handwritten::NextVelocity& of) { return handwritten::Velocity{of.u, of.v}; };
  const auto cells = static_cast<double>(cell_count(layout));
  for (auto _ : state) {
    for (std::size_t n = 0; n < steps; ++n)
      handwritten::burgers2d_step(layout, read(pair(states, n)), pair(states, n + 1), weights);
    const handwritten::NextVelocity end = pair(states, steps), seed = pair(bars, 0);
    double loss = 0;
    for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
      const std::int64_t row = y * layout.stride[1];
      for (std::int64_t i = row; i < row + layout.cells[0]; ++i)
        loss += (end.u[i] * end.u[i] + end.v[i] * end.v[i]) / cells;
    }
    for (std::int64_t i = -layout.origin; i < layout.size - layout.origin; ++i) {  // halos too
      seed.u[i] = 2 * end.u[i] / cells;
      seed.v[i] = 2 * end.v[i] / cells;
    }
    benchmark::DoNotOptimize(loss);
    for (std::size_t n = steps; n-- > 0;)
      handwritten::burgers2d_adjoint(layout, read(pair(states, n)), read(pair(bars, (steps - 1 - n) % 2)),
                                     pair(bars, (steps - n) % 2), weights);
  }
  state.SetItemsProcessed(static_cast<int64_t>(state.iterations()) * cell_count(layout) * steps);
}

/// From text to callable step, loss and adjoints; the first one of a process also pays for LLVM's start.
void text_to_gradient(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(compile(burgers_1d, jit));
}

BENCHMARK_CAPTURE(burgers_2d_step, hand, hand)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_step, jit, jit)->Arg(128)->Arg(512)->Arg(1024)->Arg(2048)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_step, cpp, cpp)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_adjoint, hand, hand)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_adjoint, jit, jit)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_adjoint, cpp, cpp)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_step, jit_f32, jit_f32)
    ->Arg(128)
    ->Arg(512)
    ->Arg(1024)
    ->Arg(2048)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_step, cpp_f32, cpp_f32)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_2d_adjoint, jit_f32, jit_f32)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_2d_step, jit, jit)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_2d_step, jit_f32, jit_f32)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_3d_step, hand, hand)->Arg(256)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_3d_step, jit, jit)->Arg(256)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_3d_step, cpp, cpp)->Arg(256)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat_3d_adjoint, jit, jit)->Arg(256)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(burgers_1d_gradient, hand, hand)->Unit(benchmark::kNanosecond);
BENCHMARK_CAPTURE(burgers_1d_gradient, jit, jit)->Unit(benchmark::kNanosecond);
BENCHMARK_CAPTURE(burgers_1d_gradient, cpp, cpp)->Unit(benchmark::kNanosecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_ordinary, burgers_2d, 1, ordinary)
    ->Arg(1024)
    ->Arg(4096)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_plain, burgers_2d, 1, tuned)
    ->Arg(1024)
    ->Arg(4096)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_blocked, burgers_2d, 0, tuned)
    ->Arg(1024)
    ->Arg(4096)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_rk4_ordinary, burgers_2d_rk4, 1, ordinary)
    ->Arg(1024)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_rk4_plain, burgers_2d_rk4, 1, tuned)->Arg(1024)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, burgers_2d_rk4_blocked, burgers_2d_rk4, 0, tuned)
    ->Arg(1024)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(rk4_separate_32)->Arg(1024)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, heat_3d_ordinary, heat_3d, 1, ordinary)->Arg(256)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, heat_3d_plain, heat_3d, 1, tuned)->Arg(192)->Arg(256)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, heat_3d_blocked, heat_3d, 0, tuned)->Arg(192)->Arg(256)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, wave_3d_ordinary, wave_3d, 1, ordinary)->Arg(192)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, wave_3d_plain, wave_3d, 1, tuned)->Arg(192)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rollout_32, wave_3d_blocked, wave_3d, 0, tuned)->Arg(192)->Unit(benchmark::kMillisecond);
BENCHMARK(gradient_32_by_hand)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, burgers_2d_plain, burgers_2d_task, 1, 1)
    ->Arg(512)
    ->Arg(1024)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, burgers_2d_blocked, burgers_2d_task, 0, 1)
    ->Arg(512)
    ->Arg(1024)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, burgers_2d_blocked_4, burgers_2d_task, 4, 1)->Arg(1024)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, heat_3d_plain, heat_3d_task, 1, 1)->Arg(192)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, heat_3d_blocked, heat_3d_task, 0, 1)->Arg(192)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, wave_3d_plain, wave_3d_task, 1, 1)->Arg(96)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(gradient_32, wave_3d_blocked, wave_3d_task, 0, 1)->Arg(96)->Unit(benchmark::kMillisecond);
BENCHMARK(text_to_gradient)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dpde::bench
