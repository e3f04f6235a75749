// SPDX-License-Identifier: Apache-2.0
// Threads beside neighbours: sweeps over n^2 cells by one and by two threads, with 0 or 2 others that spin. Two threads
// must never take more than 1.1 times as long as one:
//   taskset -c 0,1 bench_team --benchmark_repetitions=9 --benchmark_enable_random_interleaving=true
//   --benchmark_report_aggregates_only=true
#include <benchmark/benchmark.h>

#include <atomic>
#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

#include "dpde/runtime/team.h"

namespace dpde::bench {
namespace {

class Neighbours {
 public:
  explicit Neighbours(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      threads_.emplace_back([this] {
        while (!ends_.load(std::memory_order_relaxed)) {
        }
      });
    }
  }
  ~Neighbours() { ends_ = true; }

 private:
  std::atomic<bool> ends_{false};
  std::vector<std::jthread> threads_;
};

void sweeps(benchmark::State& state) {
  const std::int64_t n = state.range(0), parts = 4 * state.range(1);
  const Team team(static_cast<int>(state.range(1)));
  const Neighbours neighbours(state.range(2));
  std::vector<double> from(static_cast<std::size_t>(n * n), 1.0), to = from;
  const std::int64_t steps = 4 * 1024 * 1024 / (n * n);
  for (auto _ : state) {
    for (std::int64_t step = 0; step < steps; ++step) {
      const double* const u = from.data();
      double* const next = to.data();
      team.run(parts, [&](std::int64_t part, int) {
        for (std::int64_t y = n * part / parts; y < n * (part + 1) / parts; ++y) {
          const double *row = u + y * n, *below = u + (y + n - 1) % n * n, *above = u + (y + 1) % n * n;
          for (std::int64_t x = 1; x + 1 < n; ++x)
            next[y * n + x] = row[x] + 0.2 * (row[x - 1] + row[x + 1] + below[x] + above[x] - 4 * row[x]);
        }
      });
      std::swap(from, to);
    }
    benchmark::DoNotOptimize(from.data());
  }
  state.SetItemsProcessed(state.iterations() * steps * n * n);
}
BENCHMARK(sweeps)
    ->ArgNames({"n", "threads", "neighbours"})
    ->ArgsProduct({{256, 512}, {1, 2}, {0, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dpde::bench
