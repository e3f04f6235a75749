// SPDX-License-Identifier: Apache-2.0
// Setup of dpde chart and dpde tune: the scene, the varied settings, the timing, and the references. From a chart block
// of the file; options override its lines.
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
  int reference_cells = 0;          // 0: from the block
  std::vector<std::string> errors;  // l2(u); none: from the block
  std::string task;                 // its gradient is compared too; "": from the block
  bool manufactured = false;        // compare with a manufactured solution
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
  bool is_gradient_alone = false;  // only the gradient's error is wanted
  double accuracy = 0;             // required of the reference; 0: as fine as the finest variant requires
};
/// The source must be loaded. Without a name the only chart of the file is used, if there is one. Returns false with
/// diagnostics on errors.
bool open_chart_scene(Job& job, const ChartWishes& wishes, ChartScene& scene);

/// `most_cells`: of the finest variant along an axis, in units of the scene's. Does not change the reference of the
/// states if the scene has an exact solution. Returns false when stopped, or after a diagnostic.
bool find_references(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
                     chart::References& references);

}  // namespace dpde::tools
