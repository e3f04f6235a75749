// SPDX-License-Identifier: Apache-2.0
#include "stability/step/step_search.h"

#include <algorithm>

namespace dpde::stability {

namespace {

/// A stable step `low` (0: none is known) and an unstable one `high`.
struct Bracket {
  double low, high;
  bool may_be_narrowed(const StepSearch& search) const {
    return low > 0 ? high - low > search.precision * high : 0.5 * high > search.shortest;
  }
  /// Narrows the bracket by a step. False if the step is unstable.
  bool ask(const StepSearch& search, double step) {
    const bool is_stable = search.is_stable(step);
    (is_stable ? low : high) = step;
    return is_stable;
  }
};

constexpr double part_of_precision = 1.0 / 8;

/// Tries both sides of guesses, and from a wrong guess goes on in growing strides.
void narrow_by_guesses(const StepSearch& search, Bracket& bracket) {
  constexpr int most_guesses = 4;
  constexpr double farther = 4;
  const double nearest = part_of_precision * search.precision;
  bool was_guessed = false;
  for (int i = 0; i < most_guesses && !(bracket.low > 0); ++i) {
    const double below = search.begins_to_grow(bracket.high) * (1 - nearest);
    if (!(below > search.shortest) || !(below < bracket.high)) break;
    bracket.ask(search, below);
    was_guessed = true;
  }
  for (double stride = 2 * nearest; was_guessed && bracket.low > 0 && bracket.may_be_narrowed(search);
       stride *= farther) {
    const double above = bracket.low * (1 + stride);
    if (!(above < bracket.high) || !bracket.ask(search, above)) return;
  }
  for (double stride = 2 * nearest; was_guessed && !(bracket.low > 0) && stride < 1; stride *= farther) {
    const double below = bracket.high * (1 - stride);
    if (!(below > search.shortest) || bracket.ask(search, below)) return;
  }
}

}  // namespace

double largest_stable(const StepSearch& search, double unstable) {
  Bracket bracket{0, unstable};
  if (search.begins_to_grow) narrow_by_guesses(search, bracket);
  while (bracket.may_be_narrowed(search)) bracket.ask(search, 0.5 * (bracket.low + bracket.high));
  return bracket.low;
}

double least_positive(const std::function<double(double)>& f, double most, double precision) {
  constexpr double first = 0.98, beside = 1.0 / 3, nearest = 0.05;
  constexpr int most_looks = 24;
  double low = 0, high = most, of_high = f(most), slope = 0;
  if (!(of_high > 0)) return 0;
  double next = first * most;
  int looks_below = 0;
  for (int look = 0; look < most_looks && high - low > precision * high; ++look) {
    const double value = f(next);
    looks_below = value > 0 ? 0 : looks_below + 1;
    if (value > 0) {
      slope = (of_high - value) / (high - next);
      high = next, of_high = value;
    } else {
      low = next;
    }
    // Near the root of the secant, on the side where the bracket is wider.
    const double root = slope > 0 ? high - of_high / slope : 0, width = high - (low > 0 ? low : 0.5 * high);
    const double side = root - low > high - root ? -1 : 1;
    const bool is_lost = !(root > high - width) || !(root * (1 + beside * precision) > low) || looks_below > 1;
    next = is_lost ? high - 0.5 * width
                   : std::clamp(root * (1 + side * beside * precision), high - (1 - nearest) * width,
                                high - nearest * width);
  }
  return high;
}

double first_unstable(const std::function<bool(double)>& is_stable, double shortest, double most) {
  for (double step = shortest; step > 0 && step < most; step *= 2) {
    if (!is_stable(step)) return step;
  }
  return 0;
}

double unstable_by_folding(const std::function<bool(double)>& is_stable, double most, int cells) {
  constexpr double usual = 12, factor = 1.5;
  for (double step = most * std::min(1.0, usual / cells); step < most; step *= factor) {
    if (!is_stable(step)) return step;
  }
  return 0;
}

}  // namespace dpde::stability
