// SPDX-License-Identifier: Apache-2.0
// What is said of a data set: its runs, how well they are resolved, what drifts in them.
#pragma once

#include <vector>

#include "report/report.h"
#include "training/data/data_set_content.h"

namespace dpde::report {

/// Of one file. What is of the runs themselves is said of the first.
Report data_set_report(const training::DataFile& file, const std::vector<training::OrderEstimate>& estimates);

}  // namespace dpde::report
