// SPDX-License-Identifier: Apache-2.0
// The cheapest method, cells, step and precision whose error meets a tolerance: found by few runs and proven by one.
//
// Each method is run on two coarse grids or, until they resolve the solution, more. Its error falls as a power of the
// cells, its time grows as steps times cells: both are carried on to the first rung of a ladder of grids (a factor of
// the root of 2 apart) that should meet the tolerance. Methods are then proven in the order of the time they should
// take, until the next one cannot be faster than what is proven. Tolerances that single precision can meet are proven
// in it first, and in double where it misses.
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
  double most_cells = 8;     // times the scene's along each axis
  bool of_gradient = false;  // error and seconds are those of the gradient of the point options' task
  /// In place of measured seconds, for who wants the same choice every time.
  std::function<double(const Point&)> cost;
  std::function<void(const std::string&)> tell;
};

struct RunnerUp {
  Point point;         // the last run of the method
  std::string reason;  // it lost
};

struct Choice {
  std::optional<Point> chosen;  // none: nothing meets the tolerance
  std::vector<RunnerUp> runners_up;
  int tried = 0;  // runs
};

Choice tune(const SourceFile& source, const TuneOptions& options, const model::Problem& scene, const Wishes& wishes,
            const References& references);

}  // namespace dpde::chart
