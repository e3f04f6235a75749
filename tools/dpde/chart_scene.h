// SPDX-License-Identifier: Apache-2.0
// What dpde chart and dpde tune begin with: the scene, what is varied, how runs are timed, and what they are compared
// with.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chart/sweep.h"
#include "command.h"
#include "progress.h"

namespace dpde::tools {

struct Timing {
  int samples = 5;
  double seconds = 0.1;
};
/// --vary, --samples and --sample-seconds.
void add_chart_options(CLI::App& verb, std::vector<std::string>& vary, Timing& timing);

/// Each KEY=V1,V2,...; nullopt after a diagnostic.
std::optional<chart::Wishes> parse_wishes(const std::vector<std::string>& vary, DiagnosticSink& sink);

struct ChartScene {
  chart::PointOptions options;
  std::unique_ptr<driver::Session> session;
};
/// False and a diagnostic where there is none.
bool open_chart_scene(Job& job, const Timing& timing, ChartScene& scene);

/// Leaves `reference` as it is where the scene has an exact solution. False when stopped, or after a diagnostic.
bool find_reference(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
                    chart::Reference& reference);

}  // namespace dpde::tools
