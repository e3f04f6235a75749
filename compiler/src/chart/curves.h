// SPDX-License-Identifier: Apache-2.0
// Points of a chart grouped by method into curves, and comparison of these curves.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chart/point.h"

namespace dpde::chart {

/// Quantities on the axes: error of the states and seconds of a run, or those of a gradient.
enum class ChartOf { states, gradient };

/// One point of a panel.
struct Mark {
  Measured at;
  bool is_complete = false;  // it ran, was timed and has an error
  const Point* point = nullptr;

  /// Axes are logarithmic: points without a positive error are not drawn.
  bool is_drawn() const { return is_complete && at.error > 0; }
};
/// In the order of the points, which must outlive it.
struct MethodMarks {
  std::string name;
  std::vector<Mark> marks;
};
std::vector<MethodMarks> marks_of(const std::vector<Point>& points, ChartOf what);

/// The Pareto front of a method's drawn marks, i.e. its curve, from large errors to small ones.
std::vector<Mark> unbeaten_of(const MethodMarks& method);
/// The lower left convex hull of these in log-log coordinates, without points that mixtures of others beat.
std::vector<Mark> hull_of(const MethodMarks& method);
/// Exponent s in seconds ~ error^-s, by log-log least squares. Ignores errors below that of the reference, which are
/// meaningless. NaN for fewer than two points.
double slope_of(std::vector<Mark> points, double uncertainty);

/// Speed-up of a method over the first one at an error that both reach, with log-log interpolation of seconds on the
/// hulls.
struct SpeedUp {
  std::string method;
  double error = 0;          // geometric middle of the common range of errors; 0: none
  double ratio = 0;          // ratio of medians
  double low = 0, high = 0;  // 95 % interval by resampling the timings of each point; 0: too few timings
};
/// For each method with a curve, except the first.
std::vector<SpeedUp> speed_ups(const std::vector<MethodMarks>& methods);

/// Whether the quartiles differ by more than a quarter of the median, i.e. the machine was busy.
bool is_wide(const Measured& measured);
/// Whether so many complete marks are wide that the chart itself is doubtful.
bool is_machine_busy(const std::vector<MethodMarks>& methods);

}  // namespace dpde::chart
