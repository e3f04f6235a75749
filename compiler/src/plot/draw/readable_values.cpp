// SPDX-License-Identifier: Apache-2.0
#include "plot/draw/readable_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dpde::plot {

namespace {

/// The round number below the range, to a digit that the range spans; 0 if the range is wide or of rounding alone.
double base_of(const std::optional<ValueRange>& range) {
  constexpr double narrow = 1e-3, rounding = 1e-12;
  if (!range) return 0;
  const double extent = range->high - range->low, size = std::max(std::abs(range->low), std::abs(range->high));
  if (!(extent < narrow * size && extent > rounding * size)) return 0;
  const double digit = std::pow(10, std::ceil(std::log10(extent)));
  return std::floor(range->low / digit) * digit;
}

void subtract(double base, std::vector<double>& values) {
  for (double& value : values) value -= base;
}
void subtract(double base, std::optional<ValueRange>& range) {
  if (range) range = ValueRange{range->low - base, range->high - base};
}

std::string less(const std::string& label, double base) {
  return fmt::format("{} {} {:.12g}", label, base < 0 ? "+" : "\u2212", std::abs(base));
}

}  // namespace

LinePanel with_readable_values(LinePanel panel) {
  std::vector<double> ends;
  for (const Curve& curve : panel.curves) {
    if (const std::optional<ValueRange> range = range_of(curve.y)) ends.insert(ends.end(), {range->low, range->high});
  }
  const double base = panel.log_y ? 0 : base_of(range_of(ends));
  if (base == 0) return panel;
  for (Curve& curve : panel.curves) {
    for (std::vector<double>* values : {&curve.y, &curve.low, &curve.high}) subtract(base, *values);
  }
  subtract(base, panel.range);
  panel.y_label = less(panel.y_label, base);
  return panel;
}

MapPanel with_readable_values(MapPanel panel) {
  const double base = base_of(panel.range ? panel.range : range_of(panel.values));
  if (base == 0) return panel;
  subtract(base, panel.values);
  subtract(base, panel.range);
  panel.value_label = less(panel.value_label, base);
  return panel;
}

}  // namespace dpde::plot
