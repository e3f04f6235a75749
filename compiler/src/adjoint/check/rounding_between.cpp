// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/rounding_between.h"

#include <algorithm>
#include <cmath>

namespace dpde::adjoint {

namespace {

/// Smallest and largest of the values.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
};

}  // namespace

void nudge(std::span<double> values, double epsilon, std::mt19937_64& random) {
  std::uniform_int_distribution<int> units(-2, 2);
  for (double& value : values) value *= 1 + units(random) * epsilon;
}

double rounding_between(const std::function<TwoWays(double epsilon)>& nudged, double epsilon, double most) {
  constexpr int samples = 16, farther = 8;
  constexpr double far = 64;
  constexpr double allowance = 8;  // few samples underestimate the spread
  Range forward, backward, difference;
  for (int k = 0; k < samples + farther; ++k) {
    const TwoWays both = nudged(k < samples ? epsilon : far * epsilon);
    if (!std::isfinite(both.forward - both.backward)) return 0;
    difference.add(both.forward - both.backward);
    if (k >= samples) continue;
    forward.add(both.forward);
    backward.add(both.backward);
  }
  const double spread = std::max({forward.width(), backward.width(), difference.width()});
  return spread <= most ? allowance * spread : 0;
}

}  // namespace dpde::adjoint
