// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

namespace dpde {

/// No NaN, and no infinite one: 0 times that is NaN.
inline bool are_finite(std::span<const double> values) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < values.size(); ++i) sum += 0 * values[i];
  return sum == 0;
}

/// A power of two that brings the largest of the values near 1; 1 where products of two of them are in the range of
/// numbers anyhow. 0 where one is not finite.
inline double factor_into_range(std::span<const double> values) {
  double sum = 0, largest = 0;
#pragma omp simd reduction(+ : sum) reduction(max : largest)
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += 0 * values[i];
    largest = std::max(largest, std::abs(values[i]));
  }
  if (sum != 0) return 0;
  const bool is_in_range = largest == 0 || (largest > 0x1p-400 && largest < 0x1p400);
  return is_in_range ? 1 : std::exp2(std::clamp(-std::ilogb(largest), -1020, 1020));
}

inline void multiply_all(std::span<double> values, double factor) {
  if (factor == 1) return;
  for (double& value : values) value *= factor;
}

}  // namespace dpde
