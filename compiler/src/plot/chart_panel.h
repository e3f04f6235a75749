// SPDX-License-Identifier: Apache-2.0
// A chart as panels of curves.
#pragma once

#include <string>
#include <vector>

#include "chart/curves.h"
#include "plot/picture.h"

namespace dpde::plot {

struct ChartText {
  std::string title, x_label, y_label;
  std::string machine;  // "AMD EPYC, 2 cores"
};

/// One curve for each method, with quartiles as bars and mark sizes by memory. Other marks show points beaten by their
/// own method, points below the reference's uncertainty, failures by kind, and the Pareto front. Walls are at the
/// reference's error and at the tolerance (0: none).
LinePanel chart_panel(const ChartText& text, const std::vector<chart::MethodMarks>& methods, double uncertainty,
                      double tolerance);

}  // namespace dpde::plot
