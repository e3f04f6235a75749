// SPDX-License-Identifier: Apache-2.0
// The peak rate of arithmetic. Compiled with contraction, so that a multiply-add is one instruction if there is one,
// and with -O3: chains that are not in registers would measure the L1 cache.
#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "driver/memory/machine_speed.h"

namespace dpde::driver {

namespace {

constexpr int chains = 12;  // hides the latency of an instruction, with two started in each cycle
constexpr int rounds = 100'000, trials = 9;

typedef double Vector2 __attribute__((vector_size(16)));
typedef double Vector4 __attribute__((vector_size(32)));
typedef double Vector8 __attribute__((vector_size(64)));

/// Returns a result so that the compiler does not remove the work.
template <class Vector>
[[gnu::always_inline]] inline double work() {
  Vector sums[chains], factor = Vector{} + 0.999999, addend = Vector{} + 1e-6;
  for (int c = 0; c < chains; ++c) sums[c] = addend * static_cast<double>(c);
  asm volatile("" : "+m"(factor), "+m"(addend));
  for (int round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
    for (int c = 0; c < chains; ++c) sums[c] = sums[c] * factor + addend;
  }
  double total = 0;
  for (int c = 0; c < chains; ++c) total += sums[c][0];
  return total;
}

#if defined(__x86_64__)
[[gnu::target("avx512f")]] double work_of_64_bytes() { return work<Vector8>(); }
[[gnu::target("avx2,fma")]] double work_of_32_bytes() { return work<Vector4>(); }
#endif
double work_of_16_bytes() { return work<Vector2>(); }

struct Kind {
  double (*work)();
  int lanes;
};

Kind widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return {work_of_64_bytes, 8};
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return {work_of_32_bytes, 4};
#endif
  return {work_of_16_bytes, 2};
}

}  // namespace

double measure_flops(int threads) {
  const Kind kind = widest();
  const double operations = 2.0 * kind.lanes * chains * rounds;
  double best = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> rates(static_cast<std::size_t>(std::max(threads, 1)));
    {
      std::vector<std::jthread> team;
      for (double& rate : rates) {
        team.emplace_back([&] {
          const auto start = std::chrono::steady_clock::now();
          volatile double kept = kind.work();
          static_cast<void>(kept);
          rate = operations / std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        });
      }
    }
    double sum = 0;
    for (const double rate : rates) sum += rate;
    best = std::max(best, sum);
  }
  return best;
}

}  // namespace dpde::driver
