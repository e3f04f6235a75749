// SPDX-License-Identifier: Apache-2.0
// What a run went through as panels of its pictures.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "dpde/runtime/run_record.h"
#include "plot/scene_panels.h"

namespace dpde::plot {

/// Values are asked for as they are drawn, so that those of one field are held at a time.
struct DrawnRun {
  std::vector<std::string> states, outputs;  // outputs: those with a formula
  double time = 0;                           // where it ended
  std::function<std::vector<double>(const std::string&)> at_end;
  std::function<std::vector<double>(const std::string&)> at_start = nullptr;  // of states; null: not drawn
  std::vector<Curve> course = {};  // of one cell: its states over time, drawn in place of the others
};

/// Fields at the end; on one axis states at the start too.
std::vector<Panel> panels_of_run(const SceneView& scene, const DrawnRun& run);
/// Of one cell: the states over time.
LinePanel panel_of_course(const model::Problem& problem, std::vector<Curve> course);
/// Observables over time, by their logarithms where decades are spanned; none of fewer than three instants.
std::vector<Panel> panels_of_observables(const model::Problem& problem, const Series& series);

}  // namespace dpde::plot
