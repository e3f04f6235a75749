// SPDX-License-Identifier: Apache-2.0
// What is said of a chart: words with JSON, a table, and panels of a picture.
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
  std::string task;      // whose gradient is compared too; "": none
  double tolerance = 0;  // 0: none
  int threads = 1;
};

Report chart_report(const ChartOfScene& chart);
/// As CSV, a row a point.
std::string chart_table(const std::vector<chart::Point>& points);
/// Of errors and seconds of the states, and of the gradient; none where no error is above 0, as axes are logarithmic.
std::vector<plot::Panel> chart_panels(const ChartOfScene& chart);

}  // namespace dpde::report
