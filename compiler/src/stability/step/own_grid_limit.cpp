// SPDX-License-Identifier: Apache-2.0
#include "stability/step/own_grid_limit.h"

#include <algorithm>
#include <cmath>

namespace dpde::stability {

namespace {

constexpr double precision_of_grid = 1e-3;  // of a limit

/// "Never" instead of the limit if growth below it falls as a power of the step. An order near 1 counts too if growth
/// at half the limit is near `least_growth`: the limit is then only where matrix powers cease to show growth.
StepLimit weak_or(const StepLimit& limit, double own_step, const OwnGrid& grid) {
  const double step = limit.kind == StepLimit::Kind::limit ? 0.5 * limit.step : own_step;
  if (limit.kind == StepLimit::Kind::never) return limit;
  const double growth = grid.sure_growth(step), of_half = growth > 0 ? grid.sure_growth(0.5 * step) : 0;
  const double order = of_half > 0 ? std::log2(growth / of_half) : 0;
  const bool is_cut_off = limit.kind == StepLimit::Kind::limit && growth > 0.2 * OwnGrid::least_growth && order > 0.8;
  return order > 1.5 || is_cut_off ? StepLimit{StepLimit::Kind::never, 0, order} : limit;
}

/// The limit lowered to where the largest eigenvalue ceases to grow. Matrix powers do not show growth below
/// `least_growth` a step, and near a limit steps a thousandth above it may grow by less. The limit stays if the
/// eigenvalue grows in half the step, too.
StepLimit without_sure_growth(StepLimit limit, const OwnGrid& grid) {
  if (limit.kind != StepLimit::Kind::limit || !(grid.sure_growth(limit.step) > 0)) return limit;
  double low = 0.5 * limit.step, high = limit.step;
  if (grid.sure_growth(low) > 0) return limit;
  while (high - low > precision_of_grid * high) {
    const double middle = 0.5 * (low + high);
    (grid.sure_growth(middle) > 0 ? high : low) = middle;
  }
  limit.step = low;
  return limit;
}

/// The largest step up to which steps are stable.
StepLimit limit_by_search(const OwnGrid& grid, double step, const StepLimit& by_waves) {
  const bool has_limit = by_waves.kind == StepLimit::Kind::limit;
  const double factor = has_limit ? 1.25 : 2;
  double low = has_limit ? by_waves.step : step, high = low;
  const double first = low;
  const bool is_first_stable = grid.is_stable(first);
  if (is_first_stable && step < first && !grid.is_stable(step)) {
    high = step, low = 0.5 * step;
  } else if (is_first_stable && has_limit && grid.is_semi_lagrangian()) {
    return by_waves;  // longer steps may be stable again, beyond an interval of unstable ones
  } else if (is_first_stable) {
    const double end = farthest * std::max(first, grid.fastest() > 0 ? 1 / grid.fastest() : 0);
    for (high = factor * low; high < end && grid.is_stable(high); high *= factor) low = high;
    if (!(high < end)) return {};
  }
  while (low > shortest * std::min(first, step) && !grid.is_stable(low)) high = low, low /= 2;
  if (!(low > shortest * std::min(first, step))) return {StepLimit::Kind::never, 0, 1};
  while (high - low > precision_of_grid * high) {
    const double middle = 0.5 * (low + high);
    (grid.is_stable(middle) ? low : high) = middle;
  }
  return {StepLimit::Kind::limit, low};
}

}  // namespace

StepLimit limit_on(const OwnGrid& grid, double own_step, const StepLimit& by_waves) {
  return without_sure_growth(weak_or(limit_by_search(grid, own_step, by_waves), own_step, grid), grid);
}

}  // namespace dpde::stability
