// SPDX-License-Identifier: Apache-2.0
// What dpde chart and dpde tune begin with: the scene, what is varied, how runs are timed, and what they are compared
// with: by a chart block of the file, and options in the place of its lines.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chart/sweep.h"
#include "command.h"
#include "model/chart_from_ast.h"
#include "progress.h"

namespace dpde::tools {

struct Timing {
  int samples = 5;
  double seconds = 0.1;
};
struct ChartWishes {
  std::vector<std::string> vary;    // KEY=V1,V2,...
  int reference_cells = 0;          // 0: what the block says
  std::vector<std::string> errors;  // l2(u); none: what the block says
  std::string task;                 // whose gradient is compared too; "": what the block says
  bool manufactured = false;        // compare with a solution that is made up
  Timing timing;
};
/// --vary, --error, --task, --reference-cells, --manufactured, --samples and --sample-seconds.
void add_chart_options(CLI::App& verb, ChartWishes& wishes, const std::string& which_timing);

struct ChartScene {
  std::optional<model::Chart> block;
  chart::Wishes wishes;
  chart::PointOptions options;
  std::unique_ptr<driver::Session> session;
  int reference_cells = 0;         // along the first axis; 0: chosen
  bool is_gradient_alone = false;  // errors of states are not wanted
  double accuracy = 0;             // that the reference must have; 0: as fine as the finest variant asks for
};
/// The source is loaded. Without a name the only chart of the file is meant, where there is one. False and diagnostics
/// where something is wrong.
bool open_chart_scene(Job& job, const ChartWishes& wishes, ChartScene& scene);

/// `most_cells`: of the finest variant along an axis, in units of the scene's. Leaves that of the states as it is where
/// the scene has an exact solution. False when stopped, or after a diagnostic.
bool find_references(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
                     chart::References& references);

}  // namespace dpde::tools
