// SPDX-License-Identifier: Apache-2.0
// Finds the cheapest method, cells, step and precision whose error meets a tolerance, with few runs and one final
// proof.
//
// Each method runs on two coarse grids, or more until they resolve the solution. Its error is a power of the cells, and
// its time grows as steps times cells. Both are extrapolated to the first rung of a ladder of grids (with factor
// sqrt(2)) that should meet the tolerance. Methods are then proven in the order of predicted time, until the next one
// cannot be faster than the proven one. Tolerances in reach of single precision are proven in it first, and in double
// if it misses.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "chart/sweep.h"

namespace dpde::chart {

struct TuneOptions {
  PointOptions point;
  double tolerance = 0;
  double most_cells = 8;     // relative to the scene's, along each axis
  bool of_gradient = false;  // error and seconds are those of the gradient of the options' task
  /// Replaces measured seconds, for reproducible choices.
  std::function<double(const Point&)> cost;
  std::function<void(const std::string&)> tell;
};

struct RunnerUp {
  Point point;         // last run of the method
  std::string reason;  // why it lost
};

struct Choice {
  std::optional<Point> chosen;  // nullopt: nothing meets the tolerance
  std::vector<RunnerUp> runners_up;
  int tried = 0;  // number of runs
};

Choice tune(const SourceFile& source, const TuneOptions& options, const model::Problem& scene, const Wishes& wishes,
            const References& references);

}  // namespace dpde::chart
