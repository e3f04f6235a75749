// SPDX-License-Identifier: Apache-2.0
// Semi-Lagrangian steps of 1-D Burgers and their adjoint, by hand: one loop a sweep, places wrapped by comparing.
#include <cmath>

#include "handwritten.h"

namespace dpde::handwritten {
namespace {

/// The cell below the place i + d and the fraction f beyond it; |d| < n.
struct Spot {
  int64_t low, high;
  double f;
};
inline Spot spot_of(int64_t i, double d, int64_t n) {
  const double whole = std::floor(d);
  int64_t low = i + static_cast<int64_t>(whole);
  low = low < 0 ? low + n : low >= n ? low - n : low;
  return {low, low + 1 == n ? 0 : low + 1, d - whole};
}

[[gnu::noinline]] void diffuse(int64_t n, const double* __restrict u, double* __restrict mid, double c) {
  for (int64_t i = 0; i < n; ++i) mid[i] = u[i] + c * (u[i - 1] - 2 * u[i] + u[i + 1]);
}

[[gnu::noinline]] void trace(int64_t n, const double* __restrict mid, double* __restrict next, double a) {
  for (int64_t i = 0; i < n; ++i) {
    const Spot at = spot_of(i, -a * mid[i], n);
    next[i] = (1 - at.f) * mid[at.low] + at.f * mid[at.high];
  }
}

/// Slope and scatter in one loop; `bar` is 0 before.
[[gnu::noinline]] void trace_reverse(int64_t n, const double* __restrict mid, const double* __restrict seed,
                                     double* __restrict bar, double a) {
  for (int64_t i = 0; i < n; ++i) {
    const Spot at = spot_of(i, -a * mid[i], n);
    bar[i] -= a * seed[i] * (mid[at.high] - mid[at.low]);
    bar[at.low] += (1 - at.f) * seed[i];
    bar[at.high] += at.f * seed[i];
  }
}

void wrap_ends(double* row, int64_t n) {
  row[-1] = row[n - 1];
  row[n] = row[0];
}

}  // namespace

double traced_gradient(int64_t n, const double* start, double* mids, int64_t stride, int steps, Burgers p,
                       double* const work[2]) {
  double *u = work[0], *other = work[1];
  for (int64_t i = 0; i < n; ++i) u[i] = start[i];
  for (int k = 0; k < steps; ++k) {
    wrap_ends(u, n);
    diffuse(n, u, mids + k * stride, p.c);
    trace(n, mids + k * stride, u, p.a);
  }
  double loss = 0;
  for (int64_t i = 0; i < n; ++i) loss += u[i] * u[i] / static_cast<double>(n);
  for (int64_t i = 0; i < n; ++i) u[i] *= 2 / static_cast<double>(n);
  for (int k = steps - 1; k >= 0; --k) {
    for (int64_t i = 0; i < n; ++i) other[i] = 0;
    trace_reverse(n, mids + k * stride, u, other, p.a);
    wrap_ends(other, n);
    diffuse(n, other, u, p.c);
  }
  return loss;
}

}  // namespace dpde::handwritten
