// SPDX-License-Identifier: Apache-2.0
// Linear solvers on -lap(x) = b, around rings and between walls: time of an unknown. The time of one multigrid cycle
// has that of its residual in it, and the bandwidth of copies of such vectors stands beside it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "bare_transform.h"
#include "solve/fourier/fourier.h"
#include "solve/multigrid/multigrid.h"
#include "solve/solver/linear_solver.h"

namespace dpde {
namespace {

StencilMatrix laplacian(std::int64_t n, int rank, bool is_periodic) {
  StencilMatrix matrix;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis) {
    matrix.cells[axis] = n;
    matrix.periodic[axis] = is_periodic;
  }
  const auto size = static_cast<std::size_t>(matrix.size());
  matrix.offsets.push_back({0, 0, 0});
  matrix.values.emplace_back(size, 0.0);
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis) {
    for (const int step : {1, -1}) {
      std::array<int, 3> offset{};
      offset[axis] = step;
      std::vector<double> values(size, 0.0);
      for (std::size_t i = 0; i < size; ++i) {
        const auto number = static_cast<std::int64_t>(i);
        const std::array<std::int64_t, 3> cell{number % matrix.cells[0], number / matrix.cells[0] % matrix.cells[1],
                                               number / matrix.cells[0] / matrix.cells[1]};
        if (column_of(matrix, cell, offset) < 0) continue;
        values[i] = -1;
        matrix.values.front()[i] += 1;
      }
      matrix.offsets.push_back(offset);
      matrix.values.push_back(std::move(values));
    }
  }
  return matrix;
}

void count_unknowns(benchmark::State& state, double unknowns) {
  state.counters["each"] = benchmark::Counter(
      unknowns, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);  // seconds
}

void solve(benchmark::State& state, SolverMethod method) {
  const StencilMatrix matrix = laplacian(state.range(0), static_cast<int>(state.range(1)), state.range(2) != 0);
  LinearSolver solver(matrix, {.method = method, .tolerance = 1e-6});
  std::vector<double> b(static_cast<std::size_t>(matrix.size())), x(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = std::sin(static_cast<double>(i) * 1.7);
  for (auto _ : state) {
    std::ranges::fill(x, 0.0);
    benchmark::DoNotOptimize(solver.solve(b, x));
  }
  count_unknowns(state, static_cast<double>(matrix.size()));
}

/// Cycles in floats end where they come no nearer: those that are made count.
template <class Real>
void cycles_of(benchmark::State& state) {
  constexpr int cycles = 10;
  int made = 0;
  const StencilMatrix matrix = laplacian(state.range(0), static_cast<int>(state.range(1)), state.range(2) != 0);
  std::string why;
  auto multigrid = MultigridOf<Real>::of(matrix, NullSpace(matrix, 0x1p-52), {}, why);
  std::vector<double> right(static_cast<std::size_t>(matrix.size()));
  for (std::size_t i = 0; i < right.size(); ++i) right[i] = std::sin(static_cast<double>(i) * 1.7);
  NumbersOf<Real> b(multigrid->size()), x(multigrid->size());
  multigrid->pack_right(right, b);
  for (auto _ : state) {
    std::fill_n(x.data(), x.size(), Real(0));
    benchmark::DoNotOptimize(made = multigrid->iterate(b, x, 0, 0, cycles).iterations);
  }
  count_unknowns(state, static_cast<double>(matrix.size()) * made);
}

void multigrid_cycle(benchmark::State& state) { cycles_of<double>(state); }
void multigrid_cycle_in_floats(benchmark::State& state) { cycles_of<float>(state); }

/// y = x, of vectors as long as those above.
void copy(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(std::pow(state.range(0), state.range(1)));
  Numbers from(size), to(size);
  for (auto _ : state) {
    std::copy_n(from.data(), size, to.data());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  count_unknowns(state, static_cast<double>(size));
}

void sizes(benchmark::internal::Benchmark* run) {
  for (const int is_periodic : {1, 0}) {
    for (const int n : {512, 1024, 2048}) run->Args({n, 2, is_periodic});
    for (const int n : {64, 128}) run->Args({n, 3, is_periodic});
  }
  run->Unit(benchmark::kMillisecond);
}

/// Without the residual that a solve ends with.
void fourier_alone(benchmark::State& state) {
  const StencilMatrix matrix = laplacian(state.range(0), static_cast<int>(state.range(1)), state.range(2) != 0);
  std::optional<FourierSolver> solver = FourierSolver::of(matrix, 0x1p-52, true);
  std::vector<double> b(static_cast<std::size_t>(matrix.size())), x(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = std::sin(static_cast<double>(i) * 1.7);
  for (auto _ : state) benchmark::DoNotOptimize(solver->solve(b, x));
  count_unknowns(state, static_cast<double>(matrix.size()));
}

/// There and back over the whole grid by plans of FFTW itself.
void fftw_alone(benchmark::State& state) {
  const std::unique_ptr<BareTransform> transform =
      bare_transform(state.range(0), static_cast<int>(state.range(1)), state.range(2) != 0);
  if (!transform) return state.SkipWithError("FFTW is not there");
  for (auto _ : state) transform->there_and_back();
  count_unknowns(state, std::pow(static_cast<double>(state.range(0)), static_cast<double>(state.range(1))));
}

BENCHMARK(copy)->Args({512, 2})->Args({2048, 2})->Args({128, 3})->Unit(benchmark::kMillisecond);
BENCHMARK(multigrid_cycle)->Apply(sizes);
BENCHMARK(multigrid_cycle_in_floats)->Apply(sizes);
BENCHMARK_CAPTURE(solve, multigrid_to_1e_6, SolverMethod::multigrid)->Apply(sizes);
BENCHMARK_CAPTURE(solve, cg_to_1e_6, SolverMethod::cg)->Apply(sizes);
BENCHMARK_CAPTURE(solve, fourier, SolverMethod::fourier)->Apply(sizes);

void sizes_of_transforms(benchmark::internal::Benchmark* run) {
  for (const int is_periodic : {1, 0}) {
    for (const int n : {256, 500, 512, 1024}) run->Args({n, 2, is_periodic});
    run->Args({64, 3, is_periodic});
  }
  run->Unit(benchmark::kMillisecond);
}
BENCHMARK(fourier_alone)->Apply(sizes_of_transforms);
BENCHMARK(fftw_alone)->Apply(sizes_of_transforms);

}  // namespace
}  // namespace dpde
