// SPDX-License-Identifier: Apache-2.0
// Plasma: a step of Arakawa's bracket beside a loop by hand, and a step of rk4 of drift waves beside what it cannot do
// without, its transforms (by plans of FFTW itself) and the fields that have to pass through the caches.
#include <algorithm>
#include <cmath>

#include "bare_transform.h"
#include "driver/scene/session.h"
#include "generated.h"
#include "handwritten.h"

namespace dpde::bench {
namespace {

constexpr int steps = 16;  // of both scenes

const std::string bracket = R"(
model carried { field w; coefficient phi; dt(w) = -bracket(phi, w) }
scheme nine_points { time = euler }
scene s : carried with nine_points {
  grid x = 0 .. 2*pi, cells 64, periodic
  grid y = 0 .. 2*pi, cells 64, periodic
  phi = sin(x)*cos(2*y)
  initial w = cos(3*x + y)
  time 0 .. 0.016, step 0.001
})";

/// `damping`: what stands behind nu.
std::string drift_waves(const std::string& damping) {
  const auto damped = [&](const std::string& field) {
    return damping.empty() ? std::string() : " + nu*" + damping + field + ")))";
  };
  return R"(
function fall(f) = dx(dx(f)) + dy(dy(f))
model drift_waves {
  field n, omega
  param c, kappa, nu
  solve lap(phi) = omega for phi
  dt(n) = c*(phi - n) - bracket(phi, n) - kappa*dy(phi))" +
         damped("n") + R"(
  dt(omega) = c*(phi - n) - bracket(phi, omega))" +
         damped("omega") + R"(
}
scheme nine_points { dx = central(2); lap = spectral; time = rk4 }
scene s : drift_waves with nine_points {
  grid x = 0 .. 2*pi/0.15, cells 64, periodic
  grid y = 0 .. 2*pi/0.15, cells 64, periodic
  c = 1
  kappa = 1
  nu = 5e-8
  initial n = sin(0.45*y)*cos(0.3*x) + 0.5*sin(1.35*y + 1)*cos(0.15*x)
  initial omega = cos(0.6*y + 0.5)*sin(0.45*x) + 0.5*sin(1.2*y)*cos(0.3*x + 0.2)
  time 0 .. 0.4, step 0.025
})";
}

/// Of the text's scene by both, after some steps.
double difference(int64_t cells) {
  const SourceFile source("bench.dpde", bracket);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compile(bracket, jit, cells), {}, sink);
  if (!session) std::abort();
  const dpde_layout layout = square(cells);
  Field phi(layout, 0), w(layout, 1), next(layout, 2);
  const double h = 2 * M_PI / static_cast<double>(cells);
  for (int64_t y = -1; y <= cells; ++y) {
    for (int64_t x = -1; x <= cells; ++x) {
      const double at_x = (static_cast<double>(x) + 0.5) * h, at_y = (static_cast<double>(y) + 0.5) * h;
      phi.as<double>()[y * layout.stride[1] + x] = std::sin(at_x) * std::cos(2 * at_y);
      w.as<double>()[y * layout.stride[1] + x] = std::cos(3 * at_x + at_y);
    }
  }
  for (int k = 0; k < steps; ++k) {
    handwritten::arakawa_step(layout, phi.as<double>(), w.as<double>(), next.as<double>(), 0.001 / (12 * h * h));
    std::swap(w, next);
  }
  std::vector<double> by_hand(static_cast<size_t>(cell_count(layout))), found(by_hand.size());
  copy_out(layout, w.as<double>(), by_hand);
  session->rollout().run({});
  copy_out(session->rollout().initial(0).layout(), session->rollout().final_states()[0], found);
  double most = 0;
  for (size_t i = 0; i < found.size(); ++i) most = std::max(most, std::abs(found[i] - by_hand[i]));
  return most;
}

void arakawa(benchmark::State& state, Code code) {
  const dpde_layout layout = square(state.range(0), code);
  if (code != hand) {
    if (!(difference(state.range(0)) < 1e-12)) return state.SkipWithError("not what the loop by hand finds");
    return run_generated(state, bracket, code, false, layout);
  }
  std::vector<Field> f = make_fields(layout, 3);
  double *w = f[1].as<double>(), *next = f[2].as<double>();
  for (auto _ : state) {
    handwritten::arakawa_step(layout, f[0].as<double>(), w, next, 0.01 / 12);
    std::swap(w, next);
  }
  count(state, layout);
}

/// Steps of rk4.
void drift_waves_run(benchmark::State& state, const std::string& damping) {
  const std::string text = drift_waves(damping);
  const SourceFile source("bench.dpde", text);
  DiagnosticSink sink;
  driver::SessionOptions options;
  options.threads = 1;
  const auto session = driver::Session::open(source, compile(text, jit, state.range(0)), options, sink);
  if (!session) std::abort();
  for (int n = 0; n < runs_to_tune; n += steps) session->rollout().run({});
  for (auto _ : state) session->rollout().run({});
}

/// The transforms of as many steps, one there and back for each stage.
void drift_waves_transforms(benchmark::State& state) {
  const std::unique_ptr<BareTransform> transform = bare_transform(state.range(0), 2, true);
  if (!transform) return state.SkipWithError("FFTW is not there");
  for (auto _ : state) {
    for (int n = 0; n < 4 * steps; ++n) transform->there_and_back();
  }
}

/// What as many steps have to move, copied: with n, omega and the potential of each of the four stages, a step
/// reads 3, 5, 5 and 9 fields and writes 8 times one, 30 in all, which are 15 copies among 14 fields.
void drift_waves_bytes(benchmark::State& state) {
  constexpr size_t fields = 14, copies = 15;
  const auto size = static_cast<size_t>(state.range(0) * state.range(0));
  std::vector<std::vector<double>> f(fields, std::vector<double>(size, 1.0));
  for (auto _ : state) {
    for (size_t n = 0; n < copies * steps; ++n) {
      handwritten::copy(f[(2 * n + 1) % fields].data(), f[2 * n % fields].data(), static_cast<int64_t>(size));
      benchmark::ClobberMemory();
    }
  }
}

BENCHMARK_CAPTURE(arakawa, hand, hand)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(arakawa, jit, jit)->Arg(128)->Arg(512)->Arg(1024)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(arakawa, cpp, cpp)->Arg(512)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(drift_waves_run, damped, "fall(fall(fall(")->Arg(512)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(drift_waves_run, undamped, "")->Arg(512)->Unit(benchmark::kMillisecond);
BENCHMARK(drift_waves_transforms)->Arg(512)->Unit(benchmark::kMillisecond);
BENCHMARK(drift_waves_bytes)->Arg(512)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dpde::bench
