// SPDX-License-Identifier: Apache-2.0
// The points of a chart by method: one curve each, and what its ends say of another.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chart/point.h"

namespace dpde::chart {

/// What is on the axes: the error of the states and the seconds of a run, or those of a gradient.
enum class ChartOf { states, gradient };

/// One point of a panel.
struct Mark {
  Measured at;
  bool is_complete = false;  // it ran, was timed and has an error
  const Point* point = nullptr;

  /// On logarithmic axes: what has no error is on none.
  bool is_drawn() const { return is_complete && at.error > 0; }
};
/// In the order of the points, which outlive it.
struct MethodMarks {
  std::string name;
  std::vector<Mark> marks;
};
std::vector<MethodMarks> marks_of(const std::vector<Point>& points, ChartOf what);

/// Of a method's drawn marks those that none of its own beats: its curve, from large errors to small ones.
std::vector<Mark> unbeaten_of(const MethodMarks& method);
/// Of these the lower left hull, in logarithms: what mixtures of a method's points beat is left out.
std::vector<Mark> hull_of(const MethodMarks& method);
/// Seconds go as error^-slope: by least squares in logarithms, without errors below that of the reference, which tells
/// nothing of them. NaN of fewer than two points.
double slope_of(std::vector<Mark> points, double uncertainty);

/// How much faster a method is than the first one at an error that both reach: seconds on hulls, by straight lines
/// between their points in logarithms.
struct SpeedUp {
  std::string method;
  double error = 0;          // the middle, in logarithms, of those that both reach; 0: there is none
  double ratio = 0;          // of medians
  double low = 0, high = 0;  // of 95 of 100 resamplings of the timings of each point; 0: these are too few
};
/// Of each method that has a curve, the first one left out.
std::vector<SpeedUp> speed_ups(const std::vector<MethodMarks>& methods);

/// Quartiles further apart than a quarter of the median are those of a busy machine.
bool is_wide(const Measured& measured);
/// So many of the complete marks are wide that the chart itself is in doubt.
bool is_machine_busy(const std::vector<MethodMarks>& methods);

}  // namespace dpde::chart
