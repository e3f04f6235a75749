// SPDX-License-Identifier: Apache-2.0
// Passes over the cells of right sides and solutions, limited by memory bandwidth (solves by transforms are so fast
// that it counts).
#pragma once

#include <span>

#include "dpde/runtime/team.h"

namespace dpde {

/// No value is NaN or infinite; tested as 0 times the value, which is then NaN.
bool are_finite(std::span<const double> values, const Team& team = 1);
/// The same for a block of one thread.
template <class Real>
bool is_finite_block(std::span<const Real> values);

/// A power of two that scales the largest value to about 1; 1 if products of two values cannot overflow or underflow. 0
/// if a value is not finite.
double factor_into_range(std::span<const double> values, const Team& team = 1);

void multiply_all(std::span<double> values, double factor, const Team& team = 1);

struct Sums {
  double sum = 0, squares = 0;
};

/// Properties of some values, found in one pass; `largest` is the largest magnitude.
struct Extent {
  Sums sums;
  double largest = 0;
  bool is_finite = true;  // includes the sum of squares

  void join(const Extent& other);
  /// Whether squares and transforms of the values stay in the range of Real; for doubles factor_into_range is then 1.
  template <class Real>
  bool is_in_range() const;
};
template <class Real>
Extent extent_of(std::span<const Real> values);
Sums sums_of(std::span<const double> values, const Team& team = 1);

}  // namespace dpde
