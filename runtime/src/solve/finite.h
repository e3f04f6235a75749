// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace dpde {

/// No NaN, and no infinite one: 0 times that is NaN.
inline bool are_finite(std::span<const double> values) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < values.size(); ++i) sum += 0 * values[i];
  return sum == 0;
}

}  // namespace dpde
