// SPDX-License-Identifier: Apache-2.0
// The machine's rooflines and the hand-written sweeps. items/s are grid points a second (one field point and step),
// bytes/s count what must be read and written at least.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "dpde/runtime/field.h"
#include "handwritten.h"

namespace dpde {
namespace {

dpde_layout periodic_grid(const std::vector<int64_t>& cells) { return make_layout(cells, {1, 1, 1}); }

/// A field with smooth values and its halo filled.
Field wave_field(const dpde_layout& layout, int number) {
  Field field(layout, number);
  for (int64_t z = -layout.halo[2]; z < layout.cells[2] + layout.halo[2]; ++z) {
    for (int64_t y = -layout.halo[1]; y < layout.cells[1] + layout.halo[1]; ++y) {
      for (int64_t x = -layout.halo[0]; x < layout.cells[0] + layout.halo[0]; ++x) {
        const auto phase = [&](int64_t i, size_t axis) {
          return 2 * M_PI * static_cast<double>(i) / static_cast<double>(layout.cells[axis]);
        };
        field.set(std::sin(phase(x, 0) + number) * std::cos(phase(y, 1)) * std::cos(phase(z, 2)), x, y, z);
      }
    }
  }
  return field;
}

void count(benchmark::State& state, int64_t points, int64_t bytes_per_point) {
  state.SetItemsProcessed(state.iterations() * points);
  state.SetBytesProcessed(state.iterations() * points * bytes_per_point);
}

void copy(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({state.range(0) * 64});  // KiB a field / 2
  const int64_t n = layout.cells[0];
  Field from(layout, 0), to(layout, 1);
  for (auto _ : state) {
    handwritten::copy(to.as<double>(), from.as<double>(), n);
    benchmark::ClobberMemory();
  }
  count(state, n, 16);
}
BENCHMARK(copy)->ArgName("KiB")->Arg(16)->Arg(512)->Arg(16 << 10)->Arg(256 << 10);

void triad(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({state.range(0) * 64});
  const int64_t n = layout.cells[0];
  Field a(layout, 0), b(layout, 1), to(layout, 2);
  for (auto _ : state) {
    handwritten::triad(to.as<double>(), a.as<double>(), b.as<double>(), 0.5, n);
    benchmark::ClobberMemory();
  }
  count(state, n, 24);
}
BENCHMARK(triad)->ArgName("KiB")->Arg(16)->Arg(512)->Arg(16 << 10)->Arg(256 << 10);

constexpr handwritten::Burgers burgers{0.02, 0.01};
constexpr int steps = 32;

void burgers1d_forward(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({128});
  std::vector<Field> fields;
  Field memory(periodic_grid({(steps + 2) * layout.size}));
  double* trajectory = memory.as<double>() + layout.origin;
  const Field u = wave_field(layout, 0);
  std::copy_n(u.as<double>() - 1, 130, trajectory - 1);
  for (auto _ : state) {
    handwritten::burgers1d_forward(layout, trajectory, steps, burgers);
    benchmark::ClobberMemory();
  }
  count(state, 128 * steps, 16);
}
BENCHMARK(burgers1d_forward);

void burgers1d_gradient(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({128});
  Field memory(periodic_grid({(steps + 2) * layout.size}));
  double* trajectory = memory.as<double>() + layout.origin;
  const Field u = wave_field(layout, 0);
  const Field target = wave_field(layout, 1);
  Field one(layout), two(layout);
  double* const bars[2] = {one.as<double>(), two.as<double>()};
  std::copy_n(u.as<double>() - 1, 130, trajectory - 1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        handwritten::burgers1d_gradient(layout, trajectory, steps, burgers, target.as<double>(), bars));
    benchmark::ClobberMemory();
  }
  count(state, 128 * steps, 16);
}
BENCHMARK(burgers1d_gradient);

void burgers2d_step(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({state.range(0), state.range(0)});
  Field u = wave_field(layout, 0), v = wave_field(layout, 1), next_u(layout, 2), next_v(layout, 3);
  for (auto _ : state) {
    handwritten::burgers2d_step(layout, {u.as<double>(), v.as<double>()}, {next_u.as<double>(), next_v.as<double>()},
                                burgers);
    std::swap(u, next_u);
    std::swap(v, next_v);
  }
  count(state, cell_count(layout), 32);
}
BENCHMARK(burgers2d_step)->ArgName("n")->Arg(128)->Arg(1024);

void burgers2d_adjoint(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({state.range(0), state.range(0)});
  const Field u = wave_field(layout, 0), v = wave_field(layout, 1);
  Field p = wave_field(layout, 2), q = wave_field(layout, 3), bar_u(layout, 4), bar_v(layout, 5);
  for (auto _ : state) {
    handwritten::burgers2d_adjoint(layout, {u.as<double>(), v.as<double>()}, {p.as<double>(), q.as<double>()},
                                   {bar_u.as<double>(), bar_v.as<double>()}, burgers);
    benchmark::ClobberMemory();
  }
  count(state, cell_count(layout), 48);
}
BENCHMARK(burgers2d_adjoint)->ArgName("n")->Arg(128)->Arg(1024);

void heat3d_step(benchmark::State& state) {
  const dpde_layout layout = periodic_grid({state.range(0), state.range(0), state.range(0)});
  Field u = wave_field(layout, 0), next(layout, 1);
  for (auto _ : state) {
    handwritten::heat3d_step(layout, u.as<double>(), next.as<double>(), 0.1, {state.range(1), state.range(2) != 0});
    std::swap(u, next);
  }
  count(state, cell_count(layout), 16);
}
BENCHMARK(heat3d_step)
    ->ArgNames({"n", "tile", "prefetch"})
    ->Args({64, 64, 0})
    ->Args({256, 64, 0})
    ->Args({256, 256, 0})
    ->Args({256, 256, 1})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dpde
