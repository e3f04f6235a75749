// SPDX-License-Identifier: Apache-2.0
// Generated steps beside hand-written ones, as in generated_bench.cpp, for other kernels: Gray-Scott, 27 points in 3-D,
// waves with 25 points, staggered shallow water. Rows `adjoint` are to be compared with `jit` of the same kernel.
#include <benchmark/benchmark.h>

#include <string>
#include <type_traits>
#include <utility>

#include "generated.h"
#include "handwritten_kernels.h"

namespace dpde::bench {
namespace {

std::string scene(const std::string& model, const std::string& axes, const std::string& rest) {
  std::string text = model + "\nscene s : m with c {\n";
  for (const char axis : axes) text += std::string("  grid ") + axis + " = 0 .. 64, cells 64, periodic\n";
  return text + rest + "  time 0 .. 1, step 1/100\n}\n";
}

const std::string gray_scott = scene(
    "model m { field a, b; param da, db, feed, kill\n  dt(a) = da*lap(a) - a*b^2 + feed*(1 - a)\n  dt(b) = db*lap(b) + "
    "a*b^2 - (feed + kill)*b }\n"
    "scheme c { time = euler }",
    "xy", "  da = 0.01\n  db = 0.01\n  feed = 0.01\n  kill = 0.01\n  initial a = 1\n  initial b = sin(x)\n");

const std::string heat27 = scene(
    "operator lap27(u) order 2 = (14*(u[-1,0,0] + u[+1,0,0] + u[0,-1,0] + u[0,+1,0] + u[0,0,-1] + u[0,0,+1])"
    " + 3*(u[-1,-1,0] + u[+1,-1,0] + u[-1,+1,0] + u[+1,+1,0] + u[-1,0,-1] + u[+1,0,-1] + u[-1,0,+1] + u[+1,0,+1] + "
    "u[0,-1,-1] + u[0,+1,-1] + u[0,-1,+1] + u[0,+1,+1])"
    " + u[-1,-1,-1] + u[+1,-1,-1] + u[-1,+1,-1] + u[+1,+1,-1] + u[-1,-1,+1] + u[+1,-1,+1] + u[-1,+1,+1] + u[+1,+1,+1] "
    "- 128*u)/(30*hx^2)\n"
    "model m { field u; param k; dt(u) = k*lap27(u) }\nscheme c { time = euler }",
    "xyz", "  k = 0.01\n  initial u = sin(x)\n");

const std::string wave25 =
    scene("model m { field u; coefficient c2; dt(dt(u)) = c2*lap(u) }\nscheme c { lap = central(8); time = leapfrog }",
          "xyz", "  c2 = 1 + 0.1*sin(x)\n  initial u = sin(x)\n  initial dt(u) = 0\n");

const std::string wave25_velocity = wave25 +
                                    "task t : s { data heard = u from scene s at t = 1\n  unknown c2 from 1 in 0.4 .. "
                                    "1.6\n  minimise mean((u - heard)^2) at t = 1 }\n";

const std::string water = scene(
    "model m { vector u on faces; field eta; coefficient depth; param g\n  dt(eta) = -div(interpolate(depth + "
    "eta)*u)\n  dt(u) = -g*grad(eta) }\n"
    "scheme c { time = euler }",
    "xy", "  g = 0.01\n  depth = 1\n  initial u = 0\n  initial eta = sin(x)\n");

void gray_scott_step(benchmark::State& state, Code code, bool adjoint) {
  const dpde_layout layout = square(state.range(0), code);
  if (code != hand) return run_generated(state, gray_scott, code, adjoint, layout);
  std::vector<Field> f = make_fields(layout, 4);
  double* p[4] = {f[0].as<double>(), f[1].as<double>(), f[2].as<double>(), f[3].as<double>()};
  for (auto _ : state) {
    handwritten::gray_scott_step(layout, p[0], p[1], p[2], p[3], {0.01, 0.01, 0.01, 0.01, 0.01});
    std::swap(p[0], p[2]);
    std::swap(p[1], p[3]);
  }
  count(state, layout);
}

void heat27_step(benchmark::State& state, Code code, bool adjoint) {
  const dpde_layout layout = cube(state.range(0), code);
  if (code != hand) return run_generated(state, heat27, code, adjoint, layout);
  std::vector<Field> f = make_fields(layout, 2);
  double *a = f[0].as<double>(), *b = f[1].as<double>();
  for (auto _ : state) {
    handwritten::heat27_step(layout, a, b, 1e-4);
    std::swap(a, b);
  }
  count(state, layout);
}

void wave25_step(benchmark::State& state, Code code, bool adjoint) {
  run_generated(state, wave25, code, adjoint, cube(state.range(0), code, 4));
}

/// A step of the adjoint takes as long.
template <class Real>
void wave25_step_by_hand(benchmark::State& state) {
  const dpde_layout layout = cube(state.range(0), std::is_same_v<Real, float> ? jit_f32 : jit, 4);
  std::vector<Field> f = make_fields(layout, 3);
  Real *a = f[0].as<Real>(), *b = f[1].as<Real>();
  for (auto _ : state) {
    handwritten::wave25_step<Real>(layout, a, b, f[2].as<Real>(), Real(1e-2));
    std::swap(a, b);
  }
  count(state, layout);
}

/// With the gradient with respect to c2.
void wave25_velocity_step(benchmark::State& state, Code code, bool adjoint) {
  run_generated(state, wave25_velocity, code, adjoint, cube(state.range(0), code, 4));
}

void water_step(benchmark::State& state, Code code, bool adjoint) {
  const dpde_layout layout = square(state.range(0), code);
  if (code != hand) return run_generated(state, water, code, adjoint, layout);
  std::vector<Field> f = make_fields(layout, 7);
  double* p[6];
  for (int i = 0; i < 6; ++i) p[i] = f[static_cast<size_t>(i)].as<double>();
  for (auto _ : state) {
    handwritten::water_step(layout, {p[0], p[1], p[2]}, f[6].as<double>(), {p[3], p[4], p[5]}, 1e-2, 1e-2);
    for (int i = 0; i < 3; ++i) std::swap(p[i], p[i + 3]);
  }
  count(state, layout);
}

BENCHMARK_CAPTURE(gray_scott_step, hand, hand, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(gray_scott_step, jit, jit, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(gray_scott_step, cpp, cpp, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(gray_scott_step, jit_f32, jit_f32, false)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(gray_scott_step, adjoint, jit, true)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat27_step, hand, hand, false)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat27_step, jit, jit, false)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat27_step, cpp, cpp, false)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(heat27_step, adjoint, jit, true)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK(wave25_step_by_hand<double>)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK(wave25_step_by_hand<float>)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_step, jit, jit, false)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_step, cpp, cpp, false)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_step, jit_f32, jit_f32, false)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_step, adjoint, jit, true)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_step, adjoint_f32, jit_f32, true)->Arg(128)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(wave25_velocity_step, adjoint, jit, true)->Arg(192)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(water_step, hand, hand, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(water_step, jit, jit, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(water_step, cpp, cpp, false)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(water_step, adjoint, jit, true)->Arg(128)->Arg(1024)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dpde::bench
