// SPDX-License-Identifier: Apache-2.0
// Searches for the largest stable step.
#pragma once

#include <functional>

namespace dpde::stability {

struct StepSearch {
  std::function<bool(double)> is_stable;
  double precision = 0;  // relative, of the limit
  double shortest = 0;   // no shorter step is tried
  /// For a step just found unstable: the step at which its growth begins; 0: not known. It is a guess, so steps on both
  /// sides of it are tried. May be empty.
  std::function<double(double)> begins_to_grow = {};
};

/// The largest stable step below an unstable one; 0 if none is found.
double largest_stable(const StepSearch& search, double unstable);

/// The point between 0 and `most` above which `f` is positive, to the relative `precision`; 0 if f(most) is not. Above
/// a limit growth is nearly linear in the step; below, it may be 0 or noise. So the search uses the secant through two
/// positive values, and bisection if that fails.
double least_positive(const std::function<double(double)>& f, double most, double precision);

/// The first unstable step among `shortest` * 2^k below `most`; 0 if all are stable or `shortest` is 0. Upwards, as
/// steps far beyond a limit may be stable again.
double first_unstable(const std::function<bool(double)>& is_stable, double shortest, double most);

/// An unstable step near the limit below `most`, with aliasing products: these lower a limit by a factor of about the
/// number of cells along an axis.
double unstable_by_folding(const std::function<bool(double)>& is_stable, double most, int cells);

}  // namespace dpde::stability
