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

/// A curve a method with quartiles as bars and marks as large as the memory that they take; what is beaten by its own
/// method, what the reference does not resolve, what failed and how, what nothing beats; walls at the error of the
/// reference and at the tolerance (each 0: none).
LinePanel chart_panel(const ChartText& text, const std::vector<chart::MethodMarks>& methods, double uncertainty,
                      double tolerance);

}  // namespace dpde::plot
