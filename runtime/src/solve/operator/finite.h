// SPDX-License-Identifier: Apache-2.0
// Passes over the cells of right sides and solutions, which take as long as memory does (solves by transforms are so
// short that it counts).
#pragma once

#include <span>

#include "dpde/runtime/team.h"

namespace dpde {

/// No NaN, and no infinite one: 0 times that is NaN.
bool are_finite(std::span<const double> values, const Team& team = 1);
/// The same of a block that one thread has.
template <class Real>
bool is_finite_block(std::span<const Real> values);

/// A power of two that brings the largest of the values near 1; 1 where products of two of them are in the range of
/// numbers anyhow. 0 where one is not finite.
double factor_into_range(std::span<const double> values, const Team& team = 1);

void multiply_all(std::span<double> values, double factor, const Team& team = 1);

struct Sums {
  double sum = 0, squares = 0;
};

/// What there is to know of some values, found in one pass: `largest` is their largest size.
struct Extent {
  Sums sums;
  double largest = 0;
  bool is_finite = true;  // the sum of their squares, too

  void join(const Extent& other);
  /// So that what is made of squares, or of transforms, is in the range of the numbers; of doubles factor_into_range is
  /// then 1.
  template <class Real>
  bool is_in_range() const;
};
template <class Real>
Extent extent_of(std::span<const Real> values);
Sums sums_of(std::span<const double> values, const Team& team = 1);

}  // namespace dpde
