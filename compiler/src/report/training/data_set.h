// SPDX-License-Identifier: Apache-2.0
// Report of a data set: its runs, their resolution, and drifts.
#pragma once

#include <vector>

#include "report/report.h"
#include "training/data/data_set_content.h"

namespace dpde::report {

/// For one file. Facts about the runs themselves are reported with the first file.
Report data_set_report(const training::DataFile& file, const std::vector<training::OrderEstimate>& estimates);

}  // namespace dpde::report
