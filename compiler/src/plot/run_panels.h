// SPDX-License-Identifier: Apache-2.0
// Results of a run as panels of its pictures.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "dpde/runtime/run_record.h"
#include "plot/scene_panels.h"

namespace dpde::plot {

/// Values are requested when they are drawn, so that only one field is in memory at a time.
struct DrawnRun {
  std::vector<std::string> states, outputs;  // outputs: only those with a formula
  double time = 0;                           // end time
  std::function<std::vector<double>(const std::string&)> at_end;
  std::function<std::vector<double>(const std::string&)> at_start = nullptr;  // for states; null: not drawn
  std::vector<Curve> course = {};  // for one cell: time series of its states, drawn instead of the fields
};

/// Fields at the end; on one axis also states at the start unless they are constant, and for flows in a plane their
/// vorticity.
std::vector<Panel> panels_of_run(const SceneView& scene, const DrawnRun& run);
/// For one cell: the states over time.
LinePanel panel_of_course(const model::Problem& problem, std::vector<Curve> course);
/// Observables over time, on a logarithmic axis if they span decades; empty for fewer than three times.
std::vector<Panel> panels_of_observables(const model::Problem& problem, const Series& series);

}  // namespace dpde::plot
