// SPDX-License-Identifier: Apache-2.0
// Searches for the largest stable step.
#pragma once

#include <functional>

namespace dpde::stability {

struct StepSearch {
  std::function<bool(double)> is_stable;
  double precision = 0;  // of the limit, a part of it
  double shortest = 0;   // no shorter step is asked about
  /// Of a step that was just found not to be stable, where its growth begins; 0: not known. A guess: both sides of it
  /// are asked about. May be empty.
  std::function<double(double)> begins_to_grow = {};
};

/// Below a step that is not stable; 0 where none is found.
double largest_stable(const StepSearch& search, double unstable);

/// From where on `f` is positive, between 0 and `most`, up to `precision` of it; 0 where it is not at `most`. About a
/// limit growth is nearly a line above it, and below it may be nothing, or as noise: the line through two positive
/// values leads to it, and halves do where it does not.
double least_positive(const std::function<double(double)>& f, double most, double precision);

/// A step that is not stable, upwards from `shortest` by factors of 2 to below `most`: far beyond a limit steps may be
/// stable again. 0 where all are, or `shortest` is 0.
double first_unstable(const std::function<bool(double)>& is_stable, double shortest, double most);

/// The same near the largest stable one below `most`, where products fold back: that lowers a limit by about as much as
/// there are cells along an axis.
double unstable_by_folding(const std::function<bool(double)>& is_stable, double most, int cells);

}  // namespace dpde::stability
