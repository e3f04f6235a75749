// SPDX-License-Identifier: Apache-2.0
// JSON of how equations were solved, and why. driver::text_of makes the text.
#pragma once

#include <vector>

#include "driver/report/solve_report.h"
#include "support/json.h"

namespace dpde::report {

Json json_of(const std::vector<driver::SolveReport>& solves);

}  // namespace dpde::report
