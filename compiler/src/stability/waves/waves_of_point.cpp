// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/waves_of_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace dpde::stability {

namespace {

constexpr double below_all = -std::numeric_limits<double>::infinity();
constexpr double rounded_down = 1 - 1e-9;
constexpr double longest_angle = std::numbers::pi * (1 - 1e-11);

double angle_of_longest(const FrozenPoint& point, int axis) {
  return 2 * std::numbers::pi / std::max(point.longest_wave[static_cast<std::size_t>(axis)], 2.0);
}

/// The longest waves of the grid: along each axis, and along several.
std::vector<Angles> longest_waves(const FrozenPoint& point, int rank) {
  std::vector<Angles> waves;
  for (int direction = 1; direction < (1 << rank); ++direction) {
    Angles angles{};
    for (int axis = 0; axis < rank; ++axis) {
      if ((direction >> axis) % 2 != 0) angles[static_cast<std::size_t>(axis)] = angle_of_longest(point, axis);
    }
    waves.push_back(angles);
  }
  return waves;
}

/// All modes of a small periodic grid, one of each k and -k; of one cell the mean. Empty for other grids: their modes
/// are so many that waves of all lengths give the same result.
std::vector<Angles> waves_of_grid(const FrozenPoint& point, int rank) {
  constexpr double most_along = 32, most = 1024;
  double count = 1;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis) {
    const double cells = point.cells[axis];
    const bool is_ring = point.longest_wave[axis] == cells;
    if (!is_ring || cells > most_along) return {};
    count *= cells;
  }
  if (count == 1) return {Angles{}};
  std::vector<Angles> waves;
  for (int i = 1; count <= most && i < static_cast<int>(count); ++i) {
    Angles angles{};
    int rest = i, opposite = 0, stride = 1;
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis) {
      const int cells = static_cast<int>(point.cells[axis]), k = rest % cells;
      rest /= cells;
      opposite += stride * ((cells - k) % cells);
      stride *= cells;
      angles[axis] = 2 * std::numbers::pi * (2 * k > cells ? k - cells : k) / cells;
    }
    if (i <= opposite) waves.push_back(angles);
  }
  return waves;
}

/// The larger of `waves` and the value for the mean, if that is finite: a solve may leave the mean undetermined.
Largest with_mean(const Largest& waves, const std::function<double(const Angles&)>& f) {
  const double of_mean = f({});
  return std::isfinite(of_mean) && of_mean > waves.value ? Largest{{}, of_mean} : waves;
}

}  // namespace

Largest largest_over_waves(const LinearStep& linear, const FrozenPoint& point, int rank,
                           const std::function<double(const Angles&)>& f) {
  if (const std::vector<Angles> waves = waves_of_grid(point, rank); !waves.empty()) {
    Largest largest{{}, below_all};
    for (const Angles& angles : waves) {
      if (const double value = f(angles); value > largest.value) largest = {angles, value};
    }
    return with_mean(largest, f);
  }
  const auto is_longer_than_grid = [&](const Angles& angles) {
    for (int axis = 0; axis < rank; ++axis) {
      const double angle = std::abs(std::remainder(angles[static_cast<std::size_t>(axis)], 2 * std::numbers::pi));
      if (angle > 0 && angle < rounded_down * angle_of_longest(point, axis)) return true;
    }
    return false;
  };
  // Waves of nearly two cells have slopes. The wave of exactly two has none, and only grids contain it.
  const auto beside_shortest = [](Angles angles) {
    for (double& angle : angles) angle = std::clamp(angle, -longest_angle, longest_angle);
    return angles;
  };
  Largest largest = stability::largest_over_waves(rank, [&](const Angles& angles) {
    return linear.solves() && is_longer_than_grid(angles) ? below_all : f(beside_shortest(angles));
  });
  largest.angles = beside_shortest(largest.angles);
  if (linear.solves()) {
    for (const Angles& angles : longest_waves(point, rank)) {
      if (const double value = f(angles); value > largest.value) largest = {angles, value};
    }
  }
  return linear.reduces() || linear.solves() ? with_mean(largest, f) : largest;
}

}  // namespace dpde::stability
