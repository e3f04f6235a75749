// SPDX-License-Identifier: Apache-2.0
// A chart as files, text and JSON.
#pragma once

#include <string>
#include <vector>

#include "chart/point.h"
#include "command.h"

namespace dpde::tools {

struct ChartResult {
  const model::Problem& problem;
  const std::vector<chart::Point>& points;
  const chart::References& references;
  std::string task;      // whose gradient is compared too; "": none
  std::string name;      // of its files
  double tolerance = 0;  // 0: none
  int threads = 1;
};

/// Table, picture, CSV and `result`.
void write_chart(Job& job, const ChartResult& chart, Json& result);

}  // namespace dpde::tools
