// SPDX-License-Identifier: Apache-2.0
// The 3-D wave of 25 points, 128^3 cells, 40 steps: forward, and the gradient of a loss by the velocity. What
// tests/bench/devito_wave.py times with Devito.
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "generated.h"

namespace dpde::bench {
namespace {

constexpr int cells = 128, steps = 40;

const std::string text = wave_of("coefficient", "time 0 .. 0.1, step 0.1/40") +
                         "task by_velocity : s { unknown c2; minimise integral(u^2) at t = 0.1 }";

std::unique_ptr<driver::Session> open(const SourceFile& source, Code code, int threads) {
  DiagnosticSink sink;
  driver::SessionOptions options;
  options.threads = threads;
  auto session = driver::Session::open(source, compile(text, code, cells), options, sink);
  if (!session) std::abort();
  return session;
}

void wave_forward(benchmark::State& state, Code code) {
  const SourceFile source("bench.dpde", text);
  const auto session = open(source, code, static_cast<int>(state.range(0)));
  for (int n = 0; n < runs_to_tune; n += steps) session->rollout().run({});
  for (auto _ : state) session->rollout().run({});
}

void wave_gradient(benchmark::State& state, Code code) {
  const SourceFile source("bench.dpde", text);
  DiagnosticSink sink;
  const auto session = open(source, code, static_cast<int>(state.range(0)));
  const auto inverse = driver::Inverse::open(*session, source, sink);
  if (!inverse) std::abort();
  Eigen::VectorXd gradient(inverse->size());
  for (int n = 0; n < runs_to_tune; n += steps) inverse->value_and_gradient(inverse->start(), gradient);
  for (auto _ : state) benchmark::DoNotOptimize(inverse->value_and_gradient(inverse->start(), gradient));
}

BENCHMARK_CAPTURE(wave_forward, f64, jit)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(wave_forward, f32, jit_f32)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(wave_gradient, f64, jit)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(wave_gradient, f32, jit_f32)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dpde::bench
