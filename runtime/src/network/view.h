// SPDX-License-Identifier: Apache-2.0
// Values in memory, and parallel loops over them. Results never depend on the number of threads.
#pragma once

#include <cstdint>

#include "dpde/runtime/team.h"
#include "network/shape.h"

namespace dpde::nn {

template <class Real>
struct View {
  Real* data = nullptr;  // cell (0, 0, 0) of the first channel
  const Shape* shape = nullptr;

  Real* plane(int64_t channel) const { return data + channel * shape->plane; }
  Real* row(int64_t channel, int64_t number) const { return plane(channel) + shape->row(number); }
};

/// Calls `f(i)` for i in 0 .. count-1; in parallel if the total `cost`, approximately in nanoseconds, is large enough.
template <class F>
void parallel(const Team& team, int64_t count, int64_t cost, const F& f) {
  constexpr int64_t least_cost = 20'000;
  if (cost >= least_cost) return team.run(count, [&](int64_t i, int) { f(i); });
  for (int64_t i = 0; i < count; ++i) f(i);
}

/// Calls `f(begin, end)` for pieces of 0 .. count-1 that begin at multiples of `step`.
template <class F>
void parallel_pieces(const Team& team, int64_t count, int64_t step, int64_t cost, const F& f) {
  constexpr int64_t pieces_per_thread = 4;
  const int64_t steps = (count + step - 1) / step, wanted = team.threads() > 1 ? team.threads() * pieces_per_thread : 1;
  const int64_t pieces = steps < wanted ? steps : wanted,
                length = pieces > 0 ? (steps + pieces - 1) / pieces * step : 0;
  parallel(team, pieces, cost, [&](int64_t piece) {
    const int64_t begin = piece * length, end = begin + length < count ? begin + length : count;
    if (begin < end) f(begin, end);
  });
}

}  // namespace dpde::nn
