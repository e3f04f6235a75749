// SPDX-License-Identifier: Apache-2.0
// Weights of finite differences and interpolations of any order on a uniform grid, as exact whole numbers over one
// common denominator, as in textbooks. Source: B. Fornberg, Math. Comp. 51 (1988) 699, in rational numbers.
#pragma once

#include <cstdint>
#include <vector>

namespace dpde::stencil {

struct Tap {
  int place;            // in half cells from the point of evaluation
  std::int64_t weight;  // never 0
  bool operator==(const Tap&) const = default;
};

/// (d/dx)^derivative f  =  sum of weight * f(place) / (denominator * h^derivative). Taps ascend.
struct Difference {
  std::vector<Tap> taps;
  std::int64_t denominator = 1;
  int derivative = 0;
  bool operator==(const Difference&) const = default;
};

/// Weights of highest order for the derivative at 0 from values at distinct `places` (in half cells).
Difference difference(int derivative, const std::vector<int>& places);

/// Derivative (>= 1) at a cell from cells, error O(h^order), order even. Taps at even places.
Difference central_difference(int derivative, int order);
/// First derivative midway between two values one cell apart, order even. Taps at odd places.
Difference staggered_difference(int order);
/// Value midway between two values one cell apart, order even. Taps at odd places.
Difference midpoint(int order);

}  // namespace dpde::stencil
