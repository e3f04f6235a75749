// SPDX-License-Identifier: Apache-2.0
#include "plot/curve.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace dpde::plot {

namespace {

constexpr std::size_t parts = 2048;
constexpr std::size_t most_of_a_part = 5;

/// Indices of the values kept between `begin` and `end`.
std::set<std::size_t> kept_of(std::span<const double> values, std::size_t begin, std::size_t end) {
  std::set<std::size_t> kept{begin, end - 1};
  std::size_t low = end, high = end, bad = end;
  for (std::size_t i = begin; i < end; ++i) {
    if (!std::isfinite(values[i])) {
      bad = std::min(bad, i);
      continue;
    }
    if (low == end || values[i] < values[low]) low = i;
    if (high == end || values[i] > values[high]) high = i;
  }
  for (const std::size_t i : {low, high, bad}) {
    if (i != end) kept.insert(i);
  }
  return kept;
}

}  // namespace

Curve curve_of(std::string title, std::span<const double> values, const std::function<double(std::size_t)>& place) {
  Curve curve{std::move(title), {}, {}};
  const auto add = [&](std::size_t i) {
    curve.x.push_back(place(i));
    curve.y.push_back(values[i]);
  };
  if (values.size() <= parts * most_of_a_part) {
    for (std::size_t i = 0; i < values.size(); ++i) add(i);
    return curve;
  }
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t begin = values.size() * part / parts, end = values.size() * (part + 1) / parts;
    for (const std::size_t i : kept_of(values, begin, end)) add(i);
  }
  return curve;
}

}  // namespace dpde::plot
