// SPDX-License-Identifier: Apache-2.0
// Report of a chart: text with JSON, a table, and panels of a picture.
#pragma once

#include <string>
#include <vector>

#include "chart/point.h"
#include "report/report.h"

namespace dpde::report {

struct ChartOfScene {
  const model::Problem& problem;
  const std::vector<chart::Point>& points;
  const chart::References& references;
  std::string task;      // task whose gradients are also compared; "": none
  double tolerance = 0;  // 0: not given
  int threads = 1;
};

Report chart_report(const ChartOfScene& chart);
/// As CSV, one row for each point.
std::string chart_table(const std::vector<chart::Point>& points);
/// Panels of errors against seconds, for states and for the gradient. Empty if all errors are 0, since axes are
/// logarithmic.
std::vector<plot::Panel> chart_panels(const ChartOfScene& chart);

}  // namespace dpde::report
