// SPDX-License-Identifier: Apache-2.0
// What the runtime adds: the hand-written row functions called by Executor and Rollout. Compare with bench_baselines.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "burgers_programs.h"
#include "dpde/runtime/rollout.h"
#include "handwritten.h"

namespace dpde {
namespace {

using test::StreamOf;
using test::TestProgram;

void two_uniforms(const double* params, double* uniforms) {
  uniforms[0] = params[0];
  uniforms[1] = params[1];
}

Field random_field(const dpde_layout& layout, int number) {
  Field field(layout, number);
  for (int64_t i = 0; i < layout.size; ++i)
    field.as<double>()[i - layout.origin] = std::sin(0.37 * static_cast<double>(i) + number);
  return field;
}

/// The five streams of a star in 2-D.
void add_star(std::vector<StreamOf>& streams, const std::string& field) {
  for (const StreamOf& stream : {StreamOf{field}, {field, -1}, {field, 1}, {field, 0, -1}, {field, 0, 1}})
    streams.push_back(stream);
}

void nothing(const dpde_row*) {}

/// One sweep of one row that does nothing, with four streams and a periodic fill: pure overhead.
void empty_sweep(benchmark::State& state) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{128}, {1, 0, 0});
  test::BurgersPrograms programs(nothing);
  Field a(layout), b(layout);
  Executor executor(programs.step.table(), layout);
  for (auto _ : state) {
    executor.bind(0, a.as<double>());
    executor.bind(1, b.as<double>());
    executor.run();
    benchmark::ClobberMemory();
  }
}
BENCHMARK(empty_sweep);

void burgers1d_step(benchmark::State& state) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{128}, {1, 0, 0});
  test::BurgersPrograms programs(handwritten::burgers1d_row);
  Field a = random_field(layout, 0), b(layout);
  Executor executor(programs.step.table(), layout);
  executor.set_param(0, 0.5);
  executor.set_param(1, 0.01);
  executor.update_uniforms();
  for (auto _ : state) {
    executor.bind(0, a.as<double>());
    executor.bind(1, b.as<double>());
    executor.run();
    std::swap(a, b);
  }
}
BENCHMARK(burgers1d_step);

/// The adjoint row of the baselines has no gradient in nu: the sum is left out here too.
struct SmallGradient {
  test::BurgersPrograms losses;
  TestProgram step{"step", 1, {"u"}, {"u_next"}};
  TestProgram adjoint{"adjoint", 1, {"u", "u_next_bar"}, {"u_bar"}};
  TestProgram loss{"loss", 1, {"u", "target"}};
  TestProgram loss_adjoint{"loss_adjoint", 1, {"u", "target"}, {"u_bar"}};
  dpde_layout layout = make_layout(std::vector<int64_t>{128}, {1, 0, 0});
  Field target = random_field(layout, 1);

  SmallGradient() {
    step.params({"a", "c"}, two_uniforms, 2);
    step.prepare(step.fill_of("u"));
    step.sweep(handwritten::burgers1d_row, {{"u", -1}, {"u"}, {"u", 1}, {"u_next"}}, {step.fill_of("u_next")});
    step.swap("u", "u_next");
    adjoint.params({"a", "c"}, two_uniforms, 2);
    adjoint.prepare(adjoint.fill_of("u_next_bar"));
    adjoint.sweep(handwritten::burgers1d_adjoint_row,
                  {{"u", -1}, {"u"}, {"u", 1}, {"u_next_bar", -1}, {"u_next_bar"}, {"u_next_bar", 1}, {"u_bar"}},
                  {adjoint.fill_of("u_bar")});
    adjoint.swap("u_next_bar", "u_bar");
    adjoint.bars({"u", "u_next"});
    loss.sums({"loss"});
    loss.sweep(handwritten::square_row, {{"u"}, {"target"}}, {}, {"loss"});
    loss_adjoint.params({"loss_bar"}, test::loss_uniforms, 1);
    loss_adjoint.bars({"u"});
    loss_adjoint.bar_of_loss();
    loss_adjoint.sweep(handwritten::square_adjoint_row, {{"u"}, {"target"}, {"u_bar"}});
  }
  RolloutSetup setup() {
    RolloutSetup setup;
    setup.step = &step.table();
    setup.adjoint = &adjoint.table();
    setup.layout = layout;
    setup.steps = 32;
    setup.params = {{"a", 0.02}, {"c", 0.01}};
    setup.losses = {{&loss.table(), &loss_adjoint.table(), {32}, 1, {{"target", {target.as<double>()}}}}};
    return setup;
  }
};

void burgers1d_gradient(benchmark::State& state) {
  SmallGradient small;
  RolloutSetup setup = small.setup();
  setup.slots = static_cast<int>(state.range(0));
  Rollout rollout(std::move(setup));
  for (int64_t i = 0; i < 128; ++i) rollout.initial(0).set(std::sin(0.049 * static_cast<double>(i)), i);
  for (auto _ : state) benchmark::DoNotOptimize(rollout.gradient().loss);
  state.SetItemsProcessed(state.iterations() * 128 * 32);
}
BENCHMARK(burgers1d_gradient)->ArgName("slots")->Arg(32)->Arg(8)->Arg(3);

void burgers2d_step(benchmark::State& state) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{state.range(0), state.range(0)}, {1, 1, 0});
  TestProgram program("step", 2, {"u", "v"}, {"u_next", "v_next"});
  program.params({"a", "c"}, two_uniforms, 2);
  std::vector<StreamOf> streams;
  for (const char* field : {"u", "v"}) add_star(streams, field);
  streams.insert(streams.end(), {{"u_next"}, {"v_next"}});
  program.sweep(handwritten::burgers2d_row, streams, {program.fill_of("u_next"), program.fill_of("v_next")});
  Executor executor(program.table(), layout, static_cast<int>(state.range(1)));
  executor.set_param(0, 0.02);
  executor.set_param(1, 0.01);
  executor.update_uniforms();
  std::vector<Field> fields;
  for (int i = 0; i < 4; ++i) fields.push_back(random_field(layout, i));
  for (auto _ : state) {
    for (int i = 0; i < 4; ++i) executor.bind(i, fields[static_cast<size_t>(i)].as<double>());
    executor.run();
    std::swap(fields[0], fields[2]);
    std::swap(fields[1], fields[3]);
  }
  state.SetItemsProcessed(state.iterations() * cell_count(layout));
}
BENCHMARK(burgers2d_step)->ArgNames({"n", "threads"})->Args({128, 1})->Args({1024, 1})->Args({1024, 2})->UseRealTime();

void heat3d_step(benchmark::State& state) {
  const dpde_layout layout =
      make_layout(std::vector<int64_t>{state.range(0), state.range(0), state.range(0)}, {1, 1, 1});
  TestProgram program("step", 3, {"u"}, {"u_next"});
  program.params({"c", "unused"}, two_uniforms, 2);
  std::vector<StreamOf> streams;
  add_star(streams, "u");
  streams.insert(streams.end(), {{"u", 0, 0, -1}, {"u", 0, 0, 1}, {"u_next"}});
  program.sweep(handwritten::heat3d_row, streams, {program.fill_of("u_next")});
  Executor executor(program.table(), layout, static_cast<int>(state.range(1)));
  executor.set_param(0, 0.1);
  executor.update_uniforms();
  std::vector<Field> fields;
  for (int i = 0; i < 2; ++i) fields.push_back(random_field(layout, i));
  for (auto _ : state) {
    for (int i = 0; i < 2; ++i) executor.bind(i, fields[static_cast<size_t>(i)].as<double>());
    executor.run();
    std::swap(fields[0], fields[1]);
  }
  state.SetItemsProcessed(state.iterations() * cell_count(layout));
}
BENCHMARK(heat3d_step)
    ->ArgNames({"n", "threads"})
    ->Args({64, 1})
    ->Args({256, 1})
    ->Args({256, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dpde
